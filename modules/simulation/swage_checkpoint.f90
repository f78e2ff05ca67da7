!> When a run saves itself, and when it stops to go on later.
module swage_checkpoint
  use, intrinsic :: iso_fortran_env, only: int64
  use swage_comm, only: comm_t
  use swage_file_system, only: file_size, remove_file
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_signals, only: take_signals
  implicit none(type, external)
  private

  public :: checkpoint_t, restart_keys_t, take_restart, explain_restart
  public :: GO_ON, SAVE_AND_GO_ON, SAVE_AND_STOP

  !> What to do after an increment, the stronger the larger.
  integer, parameter :: GO_ON = 0
  integer, parameter :: SAVE_AND_GO_ON = 1
  integer, parameter :: SAVE_AND_STOP = 2

  !> Seconds from one restart file to the next where the input says nothing.
  real(wp), parameter :: USUAL_INTERVAL = 1800.0_wp

  !> What `&restart` says.
  type :: restart_keys_t
    !> File to start from; none when empty.
    character(len=:), allocatable :: from
    !> Start of messages about it.
    character(len=:), allocatable :: title
    !> Increments between restart files, 0 for none.
    integer :: every = 0
    !> The same in seconds.
    real(wp) :: interval = USUAL_INTERVAL
    !> Seconds that the run may take, 0 for as many as it likes.
    real(wp) :: wall_clock_limit = 0.0_wp
    !> Whether the end is saved, too.
    logical :: at_end = .false.
  end type restart_keys_t

  !> Clocks, and what was asked for. Rank 0 looks, all do the same.
  type :: checkpoint_t
    private
    type(comm_t) :: comm
    type(restart_keys_t) :: keys
    character(len=:), allocatable :: stop_file
    !> Ticks of the system clock at the start, at the last restart file and at the last increment.
    integer(int64) :: start_tick = 0_int64
    integer(int64) :: saved_tick = 0_int64
    integer(int64) :: last_tick = 0_int64
    !> The longest increment [s].
    real(wp) :: longest = 0.0_wp
    !> Why the last call of `next` said what it said.
    character(len=:), allocatable, public :: reason
  contains
    !> Start the clocks.
    procedure, public :: start => checkpoint_start
    !> Collective. What to do after an increment.
    procedure, public :: next => checkpoint_next
    !> A restart file was written.
    procedure, public :: done => checkpoint_done
  end type checkpoint_t

contains

  !> The only place where the keys of `&restart` are named.
  subroutine take_restart(group, keys)
    type(group_t), intent(inout) :: group
    type(restart_keys_t), intent(inout) :: keys

    keys%from = ''
    call group%take('from', keys%from, 'Restart file to start from, relative to the folder of '// &
                    'the input file; none by default. A file of this case goes on in its '// &
                    'results, that of another begins new ones.')
    call group%take('every', keys%every, 'Increments from one restart file to the next; 0: '// &
                    'their number does not matter.', lower=0)
    call group%take('interval', keys%interval, 'time', 'The same in seconds of the clock, on '// &
                    'which results do not depend; 0: the clock does not matter.', lower=0.0_wp)
    call group%take('wall_clock_limit', keys%wall_clock_limit, 'time', 'Seconds of the clock '// &
                    'that the run may take: before an increment that could last longer it '// &
                    'writes a restart file and stops with exit code 75. 0: no limit.', &
                    lower=0.0_wp)
    call group%take('at_end', keys%at_end, 'Write a restart file at the end of the last step, '// &
                    'to which steps can then be added.')

  end subroutine take_restart

  !> Record the keys of `&restart` in a group made for explaining.
  subroutine explain_restart(group)
    type(group_t), intent(inout) :: group

    type(restart_keys_t) :: ignored

    call take_restart(group, ignored)

  end subroutine explain_restart

  subroutine checkpoint_start(self, keys, stop_file, comm)
    class(checkpoint_t), intent(inout) :: self
    type(restart_keys_t), intent(in) :: keys
    !> Path of the file whose existence asks the run to stop.
    character(len=*), intent(in) :: stop_file
    type(comm_t), intent(in) :: comm

    self%comm = comm
    self%keys = keys
    self%stop_file = stop_file
    self%reason = ''
    self%longest = 0.0_wp
    call system_clock(self%start_tick)
    self%saved_tick = self%start_tick
    self%last_tick = self%start_tick

  end subroutine checkpoint_start

  !> Clocks and files are rank 0's, a signal may reach any rank; the strongest wish wins.
  subroutine checkpoint_next(self, n_increment, is_end, action)
    class(checkpoint_t), intent(inout) :: self
    !> Accepted increments of the run.
    integer, intent(in) :: n_increment
    !> True when nothing is left to do.
    logical, intent(in) :: is_end
    !> `GO_ON` and its like, the same on all ranks.
    integer, intent(out) :: action

    integer(int64) :: now
    integer :: wish
    logical :: end_is_asked, save_is_asked
    real(wp) :: elapsed, unsaved

    action = GO_ON
    self%reason = ''
    if (self%keys%every > 0) then
      if (mod(n_increment, self%keys%every) == 0) call want(SAVE_AND_GO_ON, '')
    end if
    if (is_end .and. self%keys%at_end) call want(SAVE_AND_GO_ON, '')
    call take_signals(save_is_asked, end_is_asked)
    if (save_is_asked) call want(SAVE_AND_GO_ON, 'signal USR1')
    if (end_is_asked) call want(SAVE_AND_STOP, 'signal TERM')
    if (self%comm%rank == 0) then
      call system_clock(now)
      self%longest = max(self%longest, seconds(self%last_tick, now))
      self%last_tick = now
      elapsed = seconds(self%start_tick, now)
      unsaved = seconds(self%saved_tick, now)
      if (self%keys%interval > 0.0_wp .and. unsaved >= self%keys%interval) then
        call want(SAVE_AND_GO_ON, '')
      end if
      if (self%keys%wall_clock_limit > 0.0_wp .and. &
          elapsed + self%longest >= self%keys%wall_clock_limit) then
        call want(SAVE_AND_STOP, 'wall_clock_limit')
      end if
      if (file_size(self%stop_file) >= 0_int64) call want(SAVE_AND_STOP, self%stop_file)
    end if

    wish = action
    call self%comm%max(action)
    if (wish < action) self%reason = 'another rank'
    ! What is done needs no stop
    if (is_end .and. action == SAVE_AND_STOP) then
      action = merge(SAVE_AND_GO_ON, GO_ON, self%keys%at_end)
    end if

  contains

    subroutine want(wanted, reason)
      integer, intent(in) :: wanted
      character(len=*), intent(in) :: reason

      if (wanted <= action) return
      action = wanted
      self%reason = reason

    end subroutine want

  end subroutine checkpoint_next

  !> The time it took counts for no increment.
  subroutine checkpoint_done(self, action)
    class(checkpoint_t), intent(inout) :: self
    !> What it was written for.
    integer, intent(in) :: action

    call system_clock(self%saved_tick)
    self%last_tick = self%saved_tick
    if (action == SAVE_AND_STOP .and. self%comm%rank == 0) call remove_file(self%stop_file)

  end subroutine checkpoint_done

  !> Seconds from one reading of the system clock to another.
  function seconds(first, last)
    integer(int64), intent(in) :: first
    integer(int64), intent(in) :: last
    real(wp) :: seconds

    integer(int64) :: rate

    call system_clock(count_rate=rate)
    seconds = real(last - first, wp) / real(max(1_int64, rate), wp)

  end function seconds

end module swage_checkpoint
