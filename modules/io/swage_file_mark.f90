!> How far a text file had grown when a run was saved, so that a run that goes on can drop what
!> came later.
!>
!> A mark is the length and the checksum of what precedes it: a file of another run is noticed.
module swage_file_mark
  use, intrinsic :: iso_fortran_env, only: int8
  use swage_checksum, only: checksum
  use swage_comm, only: comm_t
  use swage_file_system, only: file_size, set_file_size
  use swage_kinds, only: gp
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  implicit none(type, external)
  private

  public :: mark_file, check_mark, cut_to_mark

  !> Bytes in front of the mark that count.
  integer(gp), parameter :: LONGEST = 65536_gp

contains

  !> Not collective. Put the end of a file into a snapshot; rank 0 knows it.
  subroutine mark_file(name, path, comm, snapshot)
    !> Of the entry.
    character(len=*), intent(in) :: name
    !> Of a file with nothing left in buffers.
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(inout) :: snapshot

    integer(gp) :: mark(2)

    mark = 0_gp
    if (comm%rank == 0) then
      mark(1) = file_size(path)
      mark(2) = checksum_before(path, mark(1))
    end if
    call snapshot%put(name, mark)

  end subroutine mark_file

  !> Collective. Refuse a file that is not the one that was marked, grown or not.
  subroutine check_mark(name, path, comm, snapshot, status)
    character(len=*), intent(in) :: name
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault
    integer(gp) :: mark(2)

    fault = ''
    call snapshot%get(name, mark, status)
    if (comm%rank == 0 .and. .not. status%failed()) then
      if (file_size(path) < 0_gp) then
        fault = 'there is no such file'
      else if (file_size(path) < mark(1)) then
        fault = 'it is shorter than it was then'
      else if (checksum_before(path, mark(1)) /= mark(2)) then
        fault = 'it is that of another run'
      end if
      if (fault /= '') then
        call status%raise(STATUS_ERROR, 'check_mark', path//' does not belong to the restart '// &
                          'file: '//fault//'. Bring the file back, or write new results: '// &
                          '&restart from with another &output prefix', EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine check_mark

  !> Collective. Drop what has come since the mark.
  subroutine cut_to_mark(name, path, comm, snapshot, status)
    character(len=*), intent(in) :: name
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
    type(status_t), intent(inout) :: status

    integer(gp) :: mark(2)
    logical :: succeeded

    call snapshot%get(name, mark, status)
    if (comm%rank == 0 .and. .not. status%failed()) then
      call set_file_size(path, mark(1), succeeded)
      if (.not. succeeded) then
        call status%raise(STATUS_ERROR, 'cut_to_mark', path//' cannot be changed; make it '// &
                          'writable', EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine cut_to_mark

  !> Checksum of what precedes a place in a file, -1 when it cannot be read.
  function checksum_before(path, n_byte) result(value)
    character(len=*), intent(in) :: path
    !> In front of the place.
    integer(gp), intent(in) :: n_byte
    integer(gp) :: value

    integer(int8), allocatable :: buffer(:)
    integer(gp) :: first
    integer :: code, unit

    value = -1_gp
    if (n_byte < 0_gp) return
    first = max(0_gp, n_byte - LONGEST)
    allocate (buffer(n_byte - first))
    open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
          action='read', iostat=code)
    if (code /= 0) return
    read (unit, pos=first + 1_gp, iostat=code) buffer
    close (unit)
    if (code == 0) value = checksum(buffer)

  end function checksum_before

end module swage_file_mark
