/* Kills a program in the middle of writing a file; loaded into it by LD_PRELOAD.

   After write number KILL_WRITE, from 1, to files whose paths contain KILL_FILE the process ends
   itself with SIGKILL. One that comes to its end leaves the number of such writes in the file
   KILL_COUNT, if that is named. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <unistd.h>

static long n_write = 0;

static void count_write(int descriptor) {
  const char *part = getenv("KILL_FILE");
  const char *number = getenv("KILL_WRITE");
  char link[64], path[4096];
  ssize_t length;

  if (part == NULL) return;
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  length = readlink(link, path, sizeof path - 1);
  if (length < 0) return;
  path[length] = '\0';
  if (strstr(path, part) == NULL) return;
  n_write++;
  if (number != NULL && n_write == atol(number)) kill(getpid(), SIGKILL);
}

__attribute__((destructor)) static void leave_count(void) {
  const char *path = getenv("KILL_COUNT");
  FILE *file;

  /* Helpers of MPI, which write nothing, end later */
  if (path == NULL || n_write == 0) return;
  file = fopen(path, "w");
  if (file == NULL) return;
  fprintf(file, "%ld\n", n_write);
  fclose(file);
}

/* The function of the system's library, then the count. */
#define COUNTED(name, arguments, types, values) \
  ssize_t name arguments { \
    static ssize_t (*original) types = NULL; \
    ssize_t result; \
    if (original == NULL) original = (ssize_t (*) types) dlsym(RTLD_NEXT, #name); \
    result = original values; \
    count_write(descriptor); \
    return result; \
  }

COUNTED(write, (int descriptor, const void *buffer, size_t size), (int, const void *, size_t),
        (descriptor, buffer, size))
COUNTED(pwrite, (int descriptor, const void *buffer, size_t size, off_t place),
        (int, const void *, size_t, off_t), (descriptor, buffer, size, place))
COUNTED(pwrite64, (int descriptor, const void *buffer, size_t size, off64_t place),
        (int, const void *, size_t, off64_t), (descriptor, buffer, size, place))
COUNTED(writev, (int descriptor, const struct iovec *parts, int n_part),
        (int, const struct iovec *, int), (descriptor, parts, n_part))
COUNTED(pwritev, (int descriptor, const struct iovec *parts, int n_part, off_t place),
        (int, const struct iovec *, int, off_t), (descriptor, parts, n_part, place))
COUNTED(pwritev64, (int descriptor, const struct iovec *parts, int n_part, off64_t place),
        (int, const struct iovec *, int, off64_t), (descriptor, parts, n_part, place))
