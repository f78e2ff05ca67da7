!> Times of the increments: on the grid of the steps, on events, cut and regrown in between.
!>
!> The module knows no physics. Every time is computed from integers and from times that are given,
!> never accumulated: grid points, events and the end are met to the last bit, cuts or not.
module swage_step_control
  use swage_kinds, only: gp, wp
  use swage_number, only: number_text
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: step_control_t, step_grid_t, step_control_create, MOST_CUTS

  !> Largest allowed `maximum_cuts`: an increment is counted in 2^-MOST_CUTS of a segment.
  integer, parameter :: MOST_CUTS = 30
  integer(gp), parameter :: WHOLE = 2_gp**MOST_CUTS

  !> Times closer than this share of a nominal increment are the same.
  real(wp), parameter :: SAME_TIME = 1.0e-8_wp

  !> One step of the input: equal increments over a time.
  type :: step_grid_t
    !> [time], above 0.
    real(wp) :: duration = 0.0_wp
    !> At least 1.
    integer :: n_increment = 1
    !> Halvings of the nominal increment that are allowed; 0 to MOST_CUTS.
    integer :: maximum_cuts = 10
  end type step_grid_t

  !> Where a run is in time, and how long its next increment may be.
  !>
  !> The present interval of the grid is a *segment*, or several where an event splits it. Within
  !> a segment increments are \(2^{-L}\) of its length and start at multiples of that, so that
  !> halved increments always end where the segment ends.
  type :: step_control_t
    private
    type(step_grid_t), allocatable :: steps(:)
    !> Ends of the steps [time]; shape (0:n_step).
    real(wp), allocatable :: ends(:)
    !> Step in hand, and its finished grid intervals.
    integer :: step = 1
    integer :: n_done = 0
    !> Grid intervals finished in all steps.
    integer :: n_grid_done = 0
    !> Present time.
    real(wp) :: time = 0.0_wp
    !> The segment in hand [time], and whether it ends on the grid.
    real(wp) :: segment_start = 0.0_wp
    real(wp) :: segment_end = 0.0_wp
    logical :: ends_on_grid = .false.
    !> Part of the segment that is done, of WHOLE.
    integer(gp) :: position = WHOLE
    !> Length of the proposed increment, of WHOLE, and its end [time].
    integer(gp) :: proposed = 0_gp
    real(wp) :: proposed_end = 0.0_wp
    !> Increments are at most the nominal one halved so often.
    integer :: level = 0
  contains
    !> End of the next increment.
    procedure, public :: propose => step_control_propose
    !> The proposed increment is done.
    procedure, public :: accept => step_control_accept
    !> The proposed increment failed: propose a shorter one next, if that is allowed.
    procedure, public :: cut => step_control_cut
    procedure, public :: get_time => step_control_get_time
    !> When the last step ends.
    procedure, public :: get_end => step_control_get_end
    !> After which time to look for the next event: the present one, with a margin for rounding.
    procedure, public :: get_event_horizon => step_control_get_event_horizon
    !> Number of the step in hand, the last one when all are done.
    procedure, public :: get_step => step_control_get_step
    !> Grid intervals finished in all steps.
    procedure, public :: get_grid_count => step_control_get_grid_count
    !> True when the present time is a point of the grid.
    procedure, public :: is_on_grid => step_control_is_on_grid
    !> True when the present time is the end of a step.
    procedure, public :: is_at_step_end => step_control_is_at_step_end
    !> True when all steps are done.
    procedure, public :: is_done => step_control_is_done
    !> Put the place of the run into a snapshot, and take it back.
    procedure, public :: save => step_control_save
    procedure, public :: load => step_control_load
    procedure, private :: nominal => step_control_nominal
    procedure, private :: grid_time => step_control_grid_time
    procedure, private :: start_segment => step_control_start_segment
    procedure, private :: take_new_grid => step_control_take_new_grid
  end type step_control_t

contains

  !> Control of a run from time 0 through a sequence of steps.
  pure function step_control_create(steps) result(control)
    !> At least one; values as documented, which the input has checked.
    type(step_grid_t), intent(in) :: steps(:)
    type(step_control_t) :: control

    integer :: i

    allocate (control%steps, source=steps)
    allocate (control%ends(0:size(steps)))
    control%ends(0) = 0.0_wp
    do i = 1, size(steps)
      control%ends(i) = control%ends(i - 1) + steps(i)%duration
    end do

  end function step_control_create

  !> The longest increment that neither passes an event or a grid point, nor a bound, nor the
  !> length to which cuts have reduced it.
  pure subroutine step_control_propose(self, event, longest, time_end)
    class(step_control_t), intent(inout) :: self
    !> The next time to land on [time]; `huge` when there is none. Events within `SAME_TIME` of a
    !> nominal increment from the present time or the next grid point are that time.
    real(wp), intent(in) :: event
    !> Bound of the increment [time]; one below the shortest increment asks for the shortest.
    real(wp), intent(in) :: longest
    !> [time]
    real(wp), intent(out) :: time_end

    integer :: level
    real(wp) :: allowed, tolerance

    if (self%position == WHOLE) call self%start_segment(self%grid_time(self%n_done + 1), .true.)
    tolerance = SAME_TIME * self%nominal()
    if (event > self%time + tolerance .and. event < self%segment_end - tolerance) then
      call self%start_segment(event, .false.)
    end if

    associate (maximum_cuts => self%steps(self%step)%maximum_cuts, &
               length => self%segment_end - self%segment_start)
      allowed = self%nominal() * 2.0_wp**(-self%level)
      if (longest < allowed) allowed = longest
      allowed = max(allowed, self%nominal() * 2.0_wp**(-maximum_cuts))
      level = 0
      do while (level < MOST_CUTS)
        if (length * 2.0_wp**(-level) <= allowed * (1.0_wp + SAME_TIME) .and. &
            mod(self%position, WHOLE / 2_gp**level) == 0_gp) exit
        level = level + 1
      end do
    end associate

    self%proposed = WHOLE / 2_gp**level
    if (self%position + self%proposed == WHOLE) then
      self%proposed_end = self%segment_end
    else
      self%proposed_end = self%segment_start + (self%segment_end - self%segment_start) &
        * (real(self%position + self%proposed, wp) / real(WHOLE, wp))
    end if
    time_end = self%proposed_end

  end subroutine step_control_propose

  !> Go to the end of the proposed increment; never beyond the nominal increment, a cut one may be
  !> doubled.
  pure subroutine step_control_accept(self, was_easy)
    class(step_control_t), intent(inout) :: self
    !> True when an increment of twice the length is likely to succeed.
    logical, intent(in) :: was_easy

    real(wp) :: allowed, done

    done = self%proposed_end - self%time
    self%time = self%proposed_end
    self%position = self%position + self%proposed
    self%proposed = 0_gp
    ! An increment that something else has shortened proves nothing about a longer one
    allowed = self%nominal() * 2.0_wp**(-self%level)
    if (was_easy .and. done > 0.5_wp * allowed * (1.0_wp + SAME_TIME)) then
      self%level = max(0, self%level - 1)
    end if
    if (self%position < WHOLE .or. .not. self%ends_on_grid) return

    self%n_done = self%n_done + 1
    self%n_grid_done = self%n_grid_done + 1
    if (self%n_done < self%steps(self%step)%n_increment) return
    if (self%step == size(self%steps)) return

    ! The next step begins with an increment as long as this one may be, or with its nominal one
    allowed = self%nominal() * 2.0_wp**(-self%level)
    self%step = self%step + 1
    self%n_done = 0
    self%level = 0
    do while (self%nominal() * 2.0_wp**(-self%level) > allowed * (1.0_wp + SAME_TIME))
      if (self%level == self%steps(self%step)%maximum_cuts) exit
      self%level = self%level + 1
    end do

  end subroutine step_control_accept

  !> Halve the increment that was proposed last.
  pure subroutine step_control_cut(self, is_possible)
    class(step_control_t), intent(inout) :: self
    !> False when the shortest allowed increment has failed.
    logical, intent(out) :: is_possible

    real(wp) :: failed

    failed = self%proposed_end - self%time
    is_possible = .false.
    do while (self%level < self%steps(self%step)%maximum_cuts)
      self%level = self%level + 1
      ! An increment may have been shorter than allowed, ending on an event
      is_possible = self%nominal() * 2.0_wp**(-self%level) < failed * (1.0_wp - SAME_TIME)
      if (is_possible) return
    end do

  end subroutine step_control_cut

  pure function step_control_get_time(self) result(time)
    class(step_control_t), intent(in) :: self
    real(wp) :: time

    time = self%time

  end function step_control_get_time

  pure function step_control_get_end(self) result(time)
    class(step_control_t), intent(in) :: self
    real(wp) :: time

    time = self%ends(size(self%steps))

  end function step_control_get_end

  pure function step_control_get_event_horizon(self) result(time)
    class(step_control_t), intent(in) :: self
    real(wp) :: time

    time = self%time + SAME_TIME * self%nominal()

  end function step_control_get_event_horizon

  pure function step_control_get_step(self) result(step)
    class(step_control_t), intent(in) :: self
    integer :: step

    step = self%step

  end function step_control_get_step

  pure function step_control_get_grid_count(self) result(n_interval)
    class(step_control_t), intent(in) :: self
    integer :: n_interval

    n_interval = self%n_grid_done

  end function step_control_get_grid_count

  pure function step_control_is_on_grid(self) result(on_grid)
    class(step_control_t), intent(in) :: self
    logical :: on_grid

    on_grid = abs(self%time - self%grid_time(self%n_done)) <= 0.0_wp

  end function step_control_is_on_grid

  pure function step_control_is_at_step_end(self) result(at_end)
    class(step_control_t), intent(in) :: self
    logical :: at_end

    ! A step that is done has already given way to the next one
    at_end = self%is_done()
    if (self%step > 1 .and. self%n_done == 0) at_end = self%is_on_grid()

  end function step_control_is_at_step_end

  pure function step_control_is_done(self) result(done)
    class(step_control_t), intent(in) :: self
    logical :: done

    done = self%step == size(self%steps) .and. &
      self%n_done == self%steps(self%step)%n_increment

  end function step_control_is_done

  !> Length of an interval of the grid in the step in hand [time].
  pure function step_control_nominal(self) result(dt)
    class(step_control_t), intent(in) :: self
    real(wp) :: dt

    dt = self%steps(self%step)%duration / self%steps(self%step)%n_increment

  end function step_control_nominal

  !> A point of the grid of the step in hand [time].
  pure function step_control_grid_time(self, i) result(time)
    class(step_control_t), intent(in) :: self
    !> 0 to n_increment.
    integer, intent(in) :: i
    real(wp) :: time

    associate (n => self%steps(self%step)%n_increment, first => self%ends(self%step - 1), &
               last => self%ends(self%step))
      if (i == n) then
        time = last
      else
        time = first + (last - first) * (real(i, wp) / real(n, wp))
      end if
    end associate

  end function step_control_grid_time

  !> Let a segment begin at the present time.
  pure subroutine step_control_start_segment(self, segment_end, ends_on_grid)
    class(step_control_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: segment_end
    logical, intent(in) :: ends_on_grid

    self%segment_start = self%time
    self%segment_end = segment_end
    self%ends_on_grid = ends_on_grid
    self%position = 0_gp

  end subroutine step_control_start_segment

  subroutine step_control_save(self, snapshot)
    class(step_control_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('steps: ends', self%ends(1:self%step))
    call snapshot%put('steps: counts', [self%step, self%steps(self%step)%n_increment, &
                                        self%n_done, self%n_grid_done, self%level])
    call snapshot%put('steps: times', [self%time, self%segment_start, self%segment_end])
    call snapshot%put('steps: position', self%position)
    call snapshot%put('steps: ends on grid', self%ends_on_grid)

  end subroutine step_control_save

  !> Steps that are done must be those of the input. The step in hand may have got other
  !> increments: it goes on to the next point of the new grid. Steps may have been added.
  subroutine step_control_load(self, snapshot, status)
    class(step_control_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` when the steps do not lead to where the run was.
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: ends(:)
    real(wp) :: times(3)
    integer :: counts(5), i

    allocate (ends(snapshot%count('steps: ends')))
    call snapshot%get('steps: ends', ends, status)
    call snapshot%get('steps: counts', counts, status)
    call snapshot%get('steps: times', times, status)
    call snapshot%get('steps: position', self%position, status)
    call snapshot%get('steps: ends on grid', self%ends_on_grid, status)
    if (status%failed()) return

    self%step = counts(1)
    if (self%step > size(self%steps)) then
      call status%raise(STATUS_ERROR, 'step_control_load', 'the run was in step '// &
                        text(self%step)//', but the input has only '//text(size(self%steps))// &
                        ' &step')
      return
    end if
    do i = 1, self%step - 1
      if (abs(ends(i) - self%ends(i)) <= 0.0_wp) cycle
      call status%raise(STATUS_ERROR, 'step_control_load', 'step '//text(i)//' ended at time '// &
                        number_text(ends(i))//', in the input it ends at '// &
                        number_text(self%ends(i))//'; steps that are done cannot change')
      return
    end do

    self%time = times(1)
    self%segment_start = times(2)
    self%segment_end = times(3)
    self%n_done = counts(3)
    self%n_grid_done = counts(4)
    self%level = counts(5)
    if (abs(ends(self%step) - self%ends(self%step)) > 0.0_wp .or. &
        counts(2) /= self%steps(self%step)%n_increment) then
      call self%take_new_grid(status)
    else if (self%n_done == counts(2) .and. self%step < size(self%steps)) then
      ! The run was at its end, and steps have been added
      self%step = self%step + 1
      self%n_done = 0
      self%level = 0
    end if

  end subroutine step_control_load

  !> Find the present time on the grid of the step in hand.
  subroutine step_control_take_new_grid(self, status)
    class(step_control_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    associate (start => self%ends(self%step - 1), step => self%steps(self%step))
      if (self%time > self%ends(self%step) - SAME_TIME * self%nominal()) then
        call status%raise(STATUS_ERROR, 'step_control_load', 'the run has reached time '// &
                          number_text(self%time)//', step '//text(self%step)// &
                          ' of the input ends at '//number_text(self%ends(self%step)))
        return
      end if
      self%n_done = int((self%time - start) / self%nominal() + SAME_TIME)
      self%n_grid_done = sum(self%steps(:self%step - 1)%n_increment) + self%n_done
    end associate
    self%level = 0
    call self%start_segment(self%grid_time(self%n_done + 1), .true.)

  end subroutine step_control_take_new_grid

end module swage_step_control
