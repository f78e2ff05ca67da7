!> Whether a disk has room for what is about to be written.
!>
!> A full disk is the one failure that must be found beforehand: when a collective write fails on
!> one rank, HDF5 1.10 and Open MPI 4.1 leave the others waiting or the file damaged.
module swage_disk_room
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_output_path, only: folder_of
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: check_room

  !> Values of errno that mean: no. Others mean that the file system cannot tell.
  integer(c_int), parameter :: NO_SPACE_LEFT = 28_c_int
  integer(c_int), parameter :: FILE_TOO_LARGE = 27_c_int
  integer(c_int), parameter :: QUOTA_EXCEEDED = 122_c_int

  !> Read and write for the owner.
  integer(c_int), parameter :: OWNER_ONLY = int(o'600', c_int)

  interface
    !> POSIX: create a file; negative when that fails.
    function posix_creat(path, mode) result(descriptor) bind(C, name='creat')
      import :: c_char, c_int
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value, intent(in) :: mode
      integer(c_int) :: descriptor
    end function posix_creat

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

    !> POSIX: close a file.
    function posix_close(descriptor) result(fault) bind(C, name='close')
      import :: c_int
      implicit none(type, external)
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int) :: fault
    end function posix_close

    !> POSIX: remove a file.
    function posix_unlink(path) result(fault) bind(C, name='unlink')
      import :: c_char, c_int
      implicit none(type, external)
      ! C passes a text without its length
      ! allow(C071)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int) :: fault
    end function posix_unlink
  end interface

contains

  !> Collective. Refuse to write when the disk of a file, or the user's share of it, is too full.
  !>
  !> Rank 0 reserves the room in a file beside it and gives it back at once. Where that cannot be
  !> tried, there is taken to be room.
  subroutine check_room(path, n_byte, comm, status)
    !> Of the file that will grow.
    character(len=*), intent(in) :: path
    !> By how much; the same on all ranks.
    integer(gp), intent(in) :: n_byte
    type(comm_t), intent(in) :: comm
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
    type(status_t), intent(inout) :: status

    real(wp), parameter :: MEGABYTE = 1.0e6_wp
    character(len=:), allocatable :: probe
    integer(c_int) :: descriptor, fault, ignored

    if (comm%rank == 0 .and. n_byte > 0_gp) then
      probe = trim(path)//'.room'//c_null_char
      descriptor = posix_creat(probe, OWNER_ONLY)
      if (descriptor >= 0_c_int) then
        fault = posix_fallocate(descriptor, 0_c_int64_t, int(n_byte, c_int64_t))
        ignored = posix_close(descriptor)
        ignored = posix_unlink(probe)
        if (any(fault == [NO_SPACE_LEFT, FILE_TOO_LARGE, QUOTA_EXCEEDED])) then
          call status%raise(STATUS_ERROR, 'check_room', 'no room for '//trim(path)//': '// &
                            text(real(n_byte, wp) / MEGABYTE)//' MB are needed in the folder '// &
                            folder_of(path)//'; make room, or write fewer steps', EXIT_FILE)
        end if
      end if
    end if
    call comm%agree(status)

  end subroutine check_room

end module swage_disk_room
