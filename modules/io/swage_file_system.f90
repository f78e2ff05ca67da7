!> What Fortran cannot do to files: rename and remove them, set their length, set room aside for
!> them, bring them onto the disk.
!>
!> Not collective: rank 0 calls. Nothing is raised, callers know what a failure means.
module swage_file_system
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_int64_t, c_long, &
                                         c_null_char, c_ptr
  use swage_kinds, only: gp
  implicit none(type, external)
  private

  public :: rename_file, remove_file, set_file_size, extend_file, sync_file, file_size, same_file
  public :: posix_fallocate

  !> Longest path that the system resolves, with the character that ends it.
  integer, parameter :: PATH_LENGTH = 4097

  interface
    !> POSIX: another name for a file; one that has it is replaced in the same instant.
    function posix_rename(old, new) result(fault) bind(C, name='rename')
      import :: c_char, c_int
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: old(*)
      ! allow(C071)
      character(kind=c_char), intent(in) :: new(*)
      integer(c_int) :: fault
    end function posix_rename

    !> POSIX: remove a file.
    function posix_unlink(path) result(fault) bind(C, name='unlink')
      import :: c_char, c_int
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int) :: fault
    end function posix_unlink

    !> POSIX: set the length of a file.
    function posix_truncate(path, length) result(fault) bind(C, name='truncate')
      import :: c_char, c_int, c_long
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_long), value, intent(in) :: length
      integer(c_int) :: fault
    end function posix_truncate

    !> C: open a stream; null when that fails.
    function c_fopen(path, mode) result(stream) bind(C, name='fopen')
      import :: c_char, c_ptr
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      ! allow(C071)
      character(kind=c_char), intent(in) :: mode(*)
      type(c_ptr) :: stream
    end function c_fopen

    !> C: close a stream.
    function c_fclose(stream) result(fault) bind(C, name='fclose')
      import :: c_int, c_ptr
      implicit none(type, external)
      type(c_ptr), value, intent(in) :: stream
      integer(c_int) :: fault
    end function c_fclose

    !> POSIX: descriptor of a stream.
    function posix_fileno(stream) result(descriptor) bind(C, name='fileno')
      import :: c_int, c_ptr
      implicit none(type, external)
      type(c_ptr), value, intent(in) :: stream
      integer(c_int) :: descriptor
    end function posix_fileno

    !> POSIX: reserve room for a part of a file; 0 or a value of errno.
    function posix_fallocate(descriptor, offset, length) result(fault) &
      bind(C, name='posix_fallocate')
      import :: c_int, c_int64_t
      implicit none(type, external)
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int64_t), value, intent(in) :: offset
      integer(c_int64_t), value, intent(in) :: length
      integer(c_int) :: fault
    end function posix_fallocate

    !> POSIX: the path of a file without links and dots; null when there is no such file.
    function posix_realpath(path, resolved) result(place) bind(C, name='realpath')
      import :: c_char, c_ptr
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      ! allow(C071, C072)
      character(kind=c_char), intent(out) :: resolved(*)
      type(c_ptr) :: place
    end function posix_realpath

    !> POSIX: wait until a file is on the disk.
    function posix_fsync(descriptor) result(fault) bind(C, name='fsync')
      import :: c_int
      implicit none(type, external)
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int) :: fault
    end function posix_fsync
  end interface

contains

  !> Give a file another name. A file that had it is gone, unless the call fails.
  subroutine rename_file(old, new, succeeded)
    character(len=*), intent(in) :: old
    character(len=*), intent(in) :: new
    logical, intent(out) :: succeeded

    succeeded = posix_rename(old//c_null_char, new//c_null_char) == 0_c_int

  end subroutine rename_file

  !> Remove a file if it is there.
  subroutine remove_file(path)
    character(len=*), intent(in) :: path

    integer(c_int) :: ignored

    ignored = posix_unlink(path//c_null_char)

  end subroutine remove_file

  !> Drop the end of a file, or add a hole to it.
  subroutine set_file_size(path, n_byte, succeeded)
    character(len=*), intent(in) :: path
    !> Its length afterwards.
    integer(gp), intent(in) :: n_byte
    logical, intent(out) :: succeeded

    succeeded = posix_truncate(path//c_null_char, int(n_byte, c_long)) == 0_c_int

  end subroutine set_file_size

  !> Make a file longer by zeros that have their room on the disk.
  subroutine extend_file(path, n_byte, fault)
    character(len=*), intent(in) :: path
    !> By how much; positive.
    integer(gp), intent(in) :: n_byte
    !> Value of errno, 0 when it is done, -1 when the file cannot be opened.
    integer(c_int), intent(out) :: fault

    integer(c_int) :: ignored
    type(c_ptr) :: stream

    fault = -1_c_int
    stream = c_fopen(path//c_null_char, 'r+'//c_null_char)
    if (.not. c_associated(stream)) return
    fault = posix_fallocate(posix_fileno(stream), int(file_size(path), c_int64_t), &
                            int(n_byte, c_int64_t))
    ignored = c_fclose(stream)

  end subroutine extend_file

  !> Wait until the content of a file is on the disk.
  subroutine sync_file(path, succeeded)
    character(len=*), intent(in) :: path
    logical, intent(out) :: succeeded

    integer(c_int) :: fault
    type(c_ptr) :: stream

    stream = c_fopen(path//c_null_char, 'r+'//c_null_char)
    succeeded = c_associated(stream)
    if (.not. succeeded) return
    fault = posix_fsync(posix_fileno(stream))
    succeeded = fault == 0_c_int
    fault = c_fclose(stream)
    succeeded = succeeded .and. fault == 0_c_int

  end subroutine sync_file

  !> Bytes of a file, -1 when there is none.
  function file_size(path) result(n_byte)
    character(len=*), intent(in) :: path
    integer(gp) :: n_byte

    logical :: is_there

    n_byte = -1_gp
    inquire (file=path, exist=is_there)
    if (is_there) inquire (file=path, size=n_byte)

  end function file_size

  !> True when two paths lead to the same file, which is there.
  function same_file(one, other) result(same)
    character(len=*), intent(in) :: one
    character(len=*), intent(in) :: other
    logical :: same

    character(kind=c_char) :: resolved(PATH_LENGTH, 2)
    integer :: i
    type(c_ptr) :: place(2)

    resolved = c_null_char
    place(1) = posix_realpath(one//c_null_char, resolved(:, 1))
    place(2) = posix_realpath(other//c_null_char, resolved(:, 2))
    same = c_associated(place(1)) .and. c_associated(place(2))
    if (.not. same) return
    do i = 1, PATH_LENGTH
      same = resolved(i, 1) == resolved(i, 2)
      if (.not. same .or. resolved(i, 1) == c_null_char) exit
    end do

  end function same_file

end module swage_file_system
