!> Whether results can be written where the user wants them, asked before the run and not after it.
module swage_output_path
  use swage_comm, only: comm_t
  use swage_path, only: is_folder
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  implicit none(type, external)
  private

  public :: check_writable, describe_refusal, folder_of

contains

  !> Collective. Refuse a prefix of result files (`folder/case`) whose folder does not exist or
  !> cannot be written. Existing files are left alone.
  subroutine check_writable(prefix, comm, status)
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, and what to do.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: probe
    character(len=256) :: reason
    integer :: code, unit

    if (comm%rank == 0) then
      probe = trim(prefix)//'.probe'
      open (newunit=unit, file=probe, status='replace', action='write', iostat=code, iomsg=reason)
      if (code == 0) then
        write (unit, '(a)', iostat=code, iomsg=reason) 'probe'
        close (unit, status='delete')
      end if
      if (code /= 0) then
        call status%raise(STATUS_ERROR, 'check_writable', 'results '//trim(prefix)// &
                          '.* cannot be written: '//explain(folder_of(prefix), reason), EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine check_writable

  !> Why a file could not be created, in words; for a message, after the attempt failed.
  function describe_refusal(path) result(words)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: words

    character(len=256) :: reason
    integer :: code, unit
    logical :: is_there

    reason = ''
    inquire (file=trim(path), exist=is_there)
    open (newunit=unit, file=trim(path), action='readwrite', iostat=code, iomsg=reason)
    if (code == 0 .and. is_there) then
      close (unit, status='keep')
    else if (code == 0) then
      close (unit, status='delete')
    end if
    if (code == 0) then
      words = 'the disk may be full, or another program may hold the file'
    else
      words = explain(folder_of(path), reason)
    end if

  end function describe_refusal

  !> The folder of a path; `.` when it names none.
  pure function folder_of(path) result(folder)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: folder

    integer :: slash

    slash = index(trim(path), '/', back=.true.)
    select case (slash)
    case (0)
      folder = '.'
    case (1)
      folder = '/'
    case default
      folder = path(:slash - 1)
    end select

  end function folder_of

  !> What is wrong with a folder, and what to do.
  function explain(folder, reason) result(words)
    character(len=*), intent(in) :: folder
    !> What the run-time library said.
    character(len=*), intent(in) :: reason
    character(len=:), allocatable :: words

    logical :: is_there

    inquire (file=folder, exist=is_there)
    if (is_folder(folder)) then
      words = trim(reason)//'; make the folder '//folder//' writable or choose another'
    else if (is_there) then
      words = folder//' is a file, not a folder; choose another'
    else
      words = 'there is no folder '//folder//'; create it (mkdir -p '//folder// &
        ') or choose another'
    end if

  end function explain

end module swage_output_path
