!> The status file of a run: one line an increment, accepted or not, in fixed columns.
module swage_status_file
  use swage_comm, only: comm_t
  use swage_file_mark, only: check_mark, cut_to_mark, mark_file
  use swage_kinds, only: wp
  use swage_output_path, only: describe_refusal
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_units, only: units_t
  implicit none(type, external)
  private

  public :: status_file_t

  !> Entry of a snapshot that says how far the file had grown.
  character(len=*), parameter :: MARK = 'status file'

  !> Owns a file on rank 0: call `close`; do not copy.
  type :: status_file_t
    private
    type(comm_t) :: comm
    character(len=:), allocatable :: path
    integer :: unit = -1
    logical :: is_open = .false.
  contains
    !> Create the file and its header.
    procedure, public :: open => status_file_open
    !> Compare a file with what it was when a snapshot was taken.
    procedure, public :: check => status_file_check
    !> Go on behind the lines that it held then.
    procedure, public :: resume => status_file_resume
    !> Put into a snapshot where the file ends.
    procedure, public :: save => status_file_save
    !> Add the line of an increment.
    procedure, public :: append => status_file_append
    !> Harmless when nothing is open.
    procedure, public :: close => status_file_close
  end type status_file_t

contains

  !> Collective. A file that exists is replaced.
  subroutine status_file_open(self, path, comm, units, status)
    class(status_file_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> Gives the label of times.
    type(units_t), intent(in) :: units
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when the file cannot be created.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: label
    integer :: code

    call self%close()
    self%comm = comm
    self%path = trim(path)
    call units%get_label('time', label, status)
    if (comm%rank == 0) then
      open (newunit=self%unit, file=self%path, status='replace', action='write', iostat=code)
      self%is_open = code == 0
      if (self%is_open) then
        write (self%unit, '(a9,a9,a12,2a16,2x,a)', iostat=code) 'increment', 'attempt', &
          'iterations', 'time ['//label//']', 'dt ['//label//']', 'outcome'
        flush (self%unit)
      end if
      if (code /= 0) then
        call status%raise(STATUS_ERROR, 'status_file_open', 'cannot create '//self%path//': '// &
                          describe_refusal(self%path), EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine status_file_open

  !> Collective. Afterwards the file may be resumed.
  subroutine status_file_check(self, path, comm, snapshot, status)
    class(status_file_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when it is another file.
    type(status_t), intent(inout) :: status

    call self%close()
    self%comm = comm
    self%path = trim(path)
    call check_mark(MARK, self%path, comm, snapshot, status)

  end subroutine status_file_check

  !> Collective. Lines that came after the snapshot are dropped.
  subroutine status_file_resume(self, snapshot, status)
    class(status_file_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when the file cannot be written.
    type(status_t), intent(inout) :: status

    integer :: code

    call cut_to_mark(MARK, self%path, self%comm, snapshot, status)
    if (status%failed()) return
    if (self%comm%rank == 0) then
      open (newunit=self%unit, file=self%path, status='old', action='write', position='append', &
            iostat=code)
      self%is_open = code == 0
      if (.not. self%is_open) then
        call status%raise(STATUS_ERROR, 'status_file_resume', 'cannot write '//self%path//': '// &
                          describe_refusal(self%path), EXIT_FILE)
      end if
    end if
    call self%comm%agree(status)

  end subroutine status_file_resume

  subroutine status_file_save(self, snapshot)
    class(status_file_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call mark_file(MARK, self%path, self%comm, snapshot)

  end subroutine status_file_save

  !> Not collective: a status file that can no longer be written is closed, but does not end a run,
  !> whose results are elsewhere.
  subroutine status_file_append(self, increment, attempt, n_iteration, time, dt, outcome)
    class(status_file_t), intent(inout) :: self
    !> Number of the increment, from 1.
    integer, intent(in) :: increment
    !> How often it has been tried, from 1.
    integer, intent(in) :: attempt
    !> Newton iterations of this attempt.
    integer, intent(in) :: n_iteration
    !> End of the increment and its length [time].
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    !> `done`, or why the step was cut.
    character(len=*), intent(in) :: outcome

    integer :: code

    if (.not. self%is_open) return
    write (self%unit, '(i9,i9,i12,2es16.8,2x,a)', iostat=code) increment, attempt, n_iteration, &
      time, dt, trim(outcome)
    if (code == 0) flush (self%unit, iostat=code)
    if (code /= 0) call self%close()

  end subroutine status_file_append

  subroutine status_file_close(self)
    class(status_file_t), intent(inout) :: self

    if (self%is_open) close (self%unit)
    self%is_open = .false.

  end subroutine status_file_close

end module swage_status_file
