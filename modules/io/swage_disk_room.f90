!> Whether a disk has room for what is about to be written.
!>
!> A full disk is the one failure that must be found beforehand: when a collective write fails on
!> one rank, HDF5 1.10 and Open MPI 4.1 leave the others waiting, end by a fault of memory, or leave
!> the file damaged. Looking is not enough, for others write on the disk, too: a file that will grow
!> gets its room first.
module swage_disk_room
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char
  use swage_comm, only: comm_t
  use swage_file_system, only: extend_file, file_size, posix_fallocate, set_file_size
  use swage_kinds, only: gp, wp
  use swage_output_path, only: folder_of
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: check_room, reserve_t

  !> Room at the end of a file, for what will be written there.
  !>
  !> The file is longer by that. Whoever writes it cuts what it did not need, as HDF5 does when a
  !> file has grown; where it has not, `give_back` does. Rank 0 alone has it.
  type :: reserve_t
    private
    !> Length of the file without it and with it; 0 when there is none.
    integer(gp) :: start = 0_gp
    integer(gp) :: end = 0_gp
  contains
    !> Collective. Make the file longer, or refuse when there is no room.
    procedure, public :: take => reserve_take
    !> Not collective, harmless on all ranks: cut the file if nobody has since the room was taken.
    procedure, public :: give_back => reserve_give_back
  end type reserve_t

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

    character(len=:), allocatable :: probe
    integer(c_int) :: descriptor, fault, ignored

    if (comm%rank == 0 .and. n_byte > 0_gp) then
      probe = trim(path)//'.room'//c_null_char
      descriptor = posix_creat(probe, OWNER_ONLY)
      if (descriptor >= 0_c_int) then
        fault = posix_fallocate(descriptor, 0_c_int64_t, int(n_byte, c_int64_t))
        ignored = posix_close(descriptor)
        ignored = posix_unlink(probe)
        call judge(path, n_byte, fault, status)
      end if
    end if
    call comm%agree(status)

  end subroutine check_room

  !> Where room cannot be reserved, there is taken to be room; the file is made longer by a hole.
  subroutine reserve_take(self, path, n_byte, comm, status)
    class(reserve_t), intent(inout) :: self
    !> Of a file that exists.
    character(len=*), intent(in) :: path
    !> By how much it will grow, at most, besides what was taken before; the same on all ranks.
    integer(gp), intent(in) :: n_byte
    type(comm_t), intent(in) :: comm
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
    type(status_t), intent(inout) :: status

    integer(c_int) :: fault
    integer(gp) :: length
    logical :: succeeded

    if (comm%rank == 0 .and. n_byte > 0_gp) then
      length = file_size(path)
      call extend_file(path, n_byte, fault)
      call judge(path, n_byte, fault, status)
      succeeded = fault == 0_c_int
      if (.not. (succeeded .or. status%failed())) then
        call set_file_size(path, length + n_byte, succeeded)
      end if
      if (succeeded) then
        if (length /= self%end) self%start = length
        self%end = length + n_byte
      end if
    end if
    call comm%agree(status)

  end subroutine reserve_take

  subroutine reserve_give_back(self, path)
    class(reserve_t), intent(inout) :: self
    character(len=*), intent(in) :: path

    logical :: ignored

    if (self%end > self%start) then
      if (file_size(path) == self%end) call set_file_size(path, self%start, ignored)
    end if
    self%start = 0_gp
    self%end = 0_gp

  end subroutine reserve_give_back

  !> Raise a status when a value of errno says that there is no room.
  subroutine judge(path, n_byte, fault, status)
    character(len=*), intent(in) :: path
    integer(gp), intent(in) :: n_byte
    integer(c_int), intent(in) :: fault
    type(status_t), intent(inout) :: status

    real(wp), parameter :: MEGABYTE = 1.0e6_wp

    if (.not. any(fault == [NO_SPACE_LEFT, FILE_TOO_LARGE, QUOTA_EXCEEDED])) return
    call status%raise(STATUS_ERROR, 'check_room', 'no room for '//trim(path)//': '// &
                      text(real(n_byte, wp) / MEGABYTE)//' MB are needed in the folder '// &
                      folder_of(path)//'; make room, or write fewer steps', EXIT_FILE)

  end subroutine judge

end module swage_disk_room
