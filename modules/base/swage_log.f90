!> What a run tells its user: the log file, the same lines on the terminal, and the progress line.
!>
!> Only rank 0 has something to say; on other ranks every call does nothing. Layers that compute
!> do not print: they return text, which the driver hands over to the log.
module swage_log
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  use swage_kinds, only: wp
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: log_t, clock_text

  !> Seconds between two progress lines, where each one stays.
  real(wp), parameter :: LONGEST_SILENCE = 5.0_wp

  !> Environment variable that decides whether the output is a terminal (`1`) or not (`0`). Under
  !> some MPI launchers only the script that called the launcher can know.
  character(len=*), parameter :: TERMINAL_VARIABLE = 'SWAGE_TERMINAL'

  character(len=*), parameter :: CARRIAGE_RETURN = achar(13)

  interface
    !> POSIX: 1 when a file descriptor is a terminal.
    function posix_isatty(descriptor) result(answer) bind(C, name='isatty')
      import :: c_int
      implicit none(type, external)
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int) :: answer
    end function posix_isatty
  end interface

  !> The log of a run. Owns a file: call `close`; do not copy.
  type :: log_t
    private
    !> False on all ranks but 0.
    logical :: is_speaking = .false.
    !> Lines go to the terminal, too.
    logical :: is_echoing = .false.
    !> The output is a terminal, where a line can be overwritten.
    logical :: is_terminal = .false.
    logical :: has_file = .false.
    integer :: unit = -1
    !> Warnings so far.
    integer, public :: n_warning = 0
    !> A progress line was printed that stays.
    logical :: has_progress = .false.
    !> Ticks of the system clock when the run and its progress started, and at the last line.
    integer(int64) :: start = 0_int64
    integer(int64) :: progress_start = 0_int64
    integer(int64) :: last_line = 0_int64
    !> Characters of the progress line that is on the terminal now.
    integer :: n_shown = 0
    real(wp) :: time_start = 0.0_wp
    real(wp) :: time_end = 0.0_wp
    character(len=:), allocatable :: time_label
    !> The last progress line, if it was not printed.
    character(len=:), allocatable :: pending
  contains
    !> Start the log and its clock.
    procedure, public :: open => log_open
    !> A line for the file and the terminal.
    procedure, public :: write => log_write
    !> A line for the file alone: details nobody wants to watch.
    procedure, public :: note => log_note
    !> A line that starts with `warning: `; counted.
    procedure, public :: warn => log_warn
    !> Begin to show progress.
    procedure, public :: start_progress => log_start_progress
    !> Show how far the run is, on the terminal alone.
    procedure, public :: show_progress => log_show_progress
    !> The progress line is final; show it in any case.
    procedure, public :: end_progress => log_end_progress
    !> Seconds since the log was opened.
    procedure, public :: get_elapsed => log_get_elapsed
    !> Harmless when nothing is open.
    procedure, public :: close => log_close
  end type log_t

contains

  !> Not collective. A file that exists is replaced, or continued.
  subroutine log_open(self, path, rank, echo, status, append)
    class(log_t), intent(inout) :: self
    !> Of the log file; none when empty.
    character(len=*), intent(in) :: path
    !> Of the caller; only rank 0 opens the file and prints.
    integer, intent(in) :: rank
    !> Whether the terminal shows lines and progress.
    logical, intent(in) :: echo
    !> `STATUS_ERROR` with `EXIT_FILE` on rank 0 when the file cannot be created. The log can be
    !> used nevertheless.
    type(status_t), intent(inout) :: status
    !> Write behind what an existing file holds; false when absent.
    logical, intent(in), optional :: append

    character(len=256) :: reason
    character(len=8) :: answer, file_status, position
    integer :: code

    call self%close()
    self%is_speaking = rank == 0
    self%is_echoing = echo .and. self%is_speaking
    self%n_warning = 0
    call system_clock(self%start)
    self%progress_start = self%start
    self%last_line = self%start
    self%time_label = ''
    self%pending = ''
    if (.not. self%is_speaking) return

    call get_environment_variable(TERMINAL_VARIABLE, answer)
    select case (answer)
    case ('0')
      self%is_terminal = .false.
    case ('1')
      self%is_terminal = .true.
    case default
      self%is_terminal = posix_isatty(1_c_int) == 1_c_int
    end select

    if (path == '') return
    file_status = 'replace'
    position = 'asis'
    if (present(append)) then
      if (append) then
        file_status = 'unknown'
        position = 'append'
      end if
    end if
    open (newunit=self%unit, file=trim(path), status=file_status, action='write', &
          position=position, iostat=code, iomsg=reason)
    self%has_file = code == 0
    if (.not. self%has_file) then
      call status%raise(STATUS_ERROR, 'log_open', 'cannot write the log '//trim(path)//': '// &
                        trim(reason), EXIT_FILE)
    end if

  end subroutine log_open

  subroutine log_write(self, line)
    class(log_t), intent(inout) :: self
    character(len=*), intent(in) :: line

    call self%note(line)
    if (.not. self%is_echoing) return
    call wipe_progress(self)
    write (output_unit, '(a)') line
    flush (output_unit)

  end subroutine log_write

  subroutine log_note(self, line)
    class(log_t), intent(inout) :: self
    character(len=*), intent(in) :: line

    if (.not. self%has_file) return
    write (self%unit, '(a)') line
    ! A run that is killed leaves all it said
    flush (self%unit)

  end subroutine log_note

  subroutine log_warn(self, line)
    class(log_t), intent(inout) :: self
    character(len=*), intent(in) :: line

    if (.not. self%is_speaking) return
    self%n_warning = self%n_warning + 1
    call self%write('warning: '//line)

  end subroutine log_warn

  !> The remaining time is estimated from what has passed since this call.
  subroutine log_start_progress(self, time_start, time_end, time_label)
    class(log_t), intent(inout) :: self
    !> Where the run starts and where it is to end [time].
    real(wp), intent(in) :: time_start
    real(wp), intent(in) :: time_end
    !> Unit of the times: `s`.
    character(len=*), intent(in) :: time_label

    self%time_start = time_start
    self%time_end = time_end
    self%time_label = time_label
    self%pending = ''
    self%has_progress = .false.
    call system_clock(self%progress_start)

  end subroutine log_start_progress

  !> On a terminal the line replaces the last one; elsewhere a new one appears every few seconds.
  subroutine log_show_progress(self, increment, time, dt, n_iteration)
    class(log_t), intent(inout) :: self
    !> Number of the increment just finished.
    integer, intent(in) :: increment
    !> Its end and its length [time].
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    !> Newton iterations it took.
    integer, intent(in) :: n_iteration

    integer(int64) :: now
    real(wp) :: silence

    if (.not. self%is_echoing) return
    call system_clock(now)
    silence = seconds_between(self%last_line, now)
    self%pending = progress_line(self, increment, time, dt, n_iteration, now)
    if (self%is_terminal) then
      call wipe_progress(self)
      write (output_unit, '(a)', advance='no') self%pending
      flush (output_unit)
      self%n_shown = len(self%pending)
    else if (.not. self%has_progress .or. silence >= LONGEST_SILENCE) then
      write (output_unit, '(a)') self%pending
      flush (output_unit)
      self%pending = ''
      self%has_progress = .true.
      self%last_line = now
    end if

  end subroutine log_show_progress

  subroutine log_end_progress(self)
    class(log_t), intent(inout) :: self

    if (.not. self%is_echoing) return
    if (self%pending /= '') then
      call wipe_progress(self)
      write (output_unit, '(a)') self%pending
      flush (output_unit)
    end if
    self%pending = ''

  end subroutine log_end_progress

  function log_get_elapsed(self) result(seconds)
    class(log_t), intent(in) :: self
    real(wp) :: seconds

    integer(int64) :: now

    call system_clock(now)
    seconds = seconds_between(self%start, now)

  end function log_get_elapsed

  subroutine log_close(self)
    class(log_t), intent(inout) :: self

    if (self%is_echoing .and. self%n_shown > 0) call self%end_progress()
    if (self%has_file) close (self%unit)
    self%has_file = .false.
    self%is_speaking = .false.
    self%is_echoing = .false.
    self%n_shown = 0

  end subroutine log_close

  !> Step, time, share done, length of the step, iterations, time passed and to come.
  function progress_line(self, increment, time, dt, n_iteration, now) result(line)
    class(log_t), intent(in) :: self
    integer, intent(in) :: increment
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    integer, intent(in) :: n_iteration
    integer(int64), intent(in) :: now
    character(len=:), allocatable :: line

    character(len=96) :: buffer
    real(wp) :: passed, share

    share = 1.0_wp
    if (self%time_end > self%time_start) then
      share = max(0.0_wp, min(1.0_wp, (time - self%time_start) / (self%time_end - self%time_start)))
    end if
    passed = seconds_between(self%progress_start, now)
    write (buffer, '(a,i0,a,g0.4,3a,i0,a,es8.2,3a,i0)') 'step ', increment, '  t ', time, ' ', &
      self%time_label, '  ', int(100.0_wp * share), ' %  dt ', dt, ' ', self%time_label, &
      '  newton ', n_iteration
    line = trim(buffer)//'  '//clock_text(passed)
    if (share > 0.0_wp .and. share < 1.0_wp) then
      line = line//'  left '//clock_text(passed * (1.0_wp - share) / share)
    end if

  end function progress_line

  !> Blank the progress line, so that another one can be printed in its place.
  subroutine wipe_progress(self)
    class(log_t), intent(inout) :: self

    if (self%n_shown == 0) return
    write (output_unit, '(a)', advance='no') CARRIAGE_RETURN//repeat(' ', self%n_shown)// &
      CARRIAGE_RETURN
    self%n_shown = 0

  end subroutine wipe_progress

  !> Seconds as `0:07`, `12:34` or `1:02:03`.
  pure function clock_text(seconds) result(string)
    !> At least 0.
    real(wp), intent(in) :: seconds
    character(len=:), allocatable :: string

    integer(int64), parameter :: MINUTE = 60_int64, HOUR = 3600_int64
    character(len=32) :: buffer
    integer(int64) :: whole

    if (seconds >= 1.0e9_wp) then
      string = 'years'
      return
    end if
    whole = nint(seconds, int64)
    if (whole < HOUR) then
      write (buffer, '(i0,a,i2.2)') whole / MINUTE, ':', mod(whole, MINUTE)
    else
      write (buffer, '(i0,2(a,i2.2))') whole / HOUR, ':', mod(whole, HOUR) / MINUTE, ':', &
        mod(whole, MINUTE)
    end if
    string = trim(buffer)

  end function clock_text

  !> Seconds from one reading of the system clock to another.
  function seconds_between(first, last) result(seconds)
    integer(int64), intent(in) :: first
    integer(int64), intent(in) :: last
    real(wp) :: seconds

    integer(int64) :: rate

    call system_clock(count_rate=rate)
    seconds = real(last - first, wp) / real(max(1_int64, rate), wp)

  end function seconds_between

end module swage_log
