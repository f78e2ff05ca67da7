!> One coordinate of a motion as a function of time, piecewise linear.
module swage_motion_table
  use swage_kinds, only: wp
  use swage_sort, only: last_not_above
  implicit none(type, external)
  private

  public :: motion_table_t, motion_table_create

  !> A change of slope below this share of the largest slope is no event: a finely sampled smooth
  !> curve shall not force a step to end at every one of its samples.
  real(wp), parameter :: KINK = 0.05_wp

  !> Constant before its first and after its last time; empty: 0 throughout.
  type :: motion_table_t
    private
    real(wp), allocatable :: time(:)
    real(wp), allocatable :: value(:)
    !> Slope between a time and the next; 0 before the first (index 0) and after the last.
    real(wp), allocatable :: slope(:)
  contains
    !> Its value at a time.
    procedure, public :: value_at => motion_table_value_at
    !> Its slope just after a time.
    procedure, public :: slope_after => motion_table_slope_after
    !> The first kink after a time.
    procedure, public :: next_kink => motion_table_next_kink
    !> The slopes that occur, 0 among them.
    procedure, public :: get_slopes => motion_table_get_slopes
  end type motion_table_t

contains

  !> Make a table.
  pure subroutine motion_table_create(time, value, table)
    !> [time], strictly increasing.
    real(wp), intent(in) :: time(:)
    !> As many values.
    real(wp), intent(in) :: value(:)
    type(motion_table_t), intent(out) :: table

    integer :: n

    n = size(time)
    allocate (table%time, source=time)
    allocate (table%value, source=value)
    allocate (table%slope(0:n), source=0.0_wp)
    table%slope(1:n - 1) = (value(2:n) - value(1:n - 1)) / (time(2:n) - time(1:n - 1))

  end subroutine motion_table_create

  pure function motion_table_value_at(self, time) result(value)
    class(motion_table_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: value

    real(wp) :: share
    integer :: i

    value = 0.0_wp
    if (.not. allocated(self%time)) return
    i = last_not_above(self%time, time)
    if (i == 0) then
      value = self%value(1)
    else if (i == size(self%time)) then
      value = self%value(i)
    else
      share = (time - self%time(i)) / (self%time(i + 1) - self%time(i))
      value = (1.0_wp - share) * self%value(i) + share * self%value(i + 1)
    end if

  end function motion_table_value_at

  pure function motion_table_slope_after(self, time) result(slope)
    class(motion_table_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: slope

    slope = 0.0_wp
    if (.not. allocated(self%time)) return
    slope = self%slope(last_not_above(self%time, time))

  end function motion_table_slope_after

  !> `huge` when there is none. A kink nearer than rounding makes it counts as passed.
  pure function motion_table_next_kink(self, time) result(kink_time)
    class(motion_table_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: kink_time

    real(wp) :: largest
    integer :: i, n

    kink_time = huge(1.0_wp)
    if (.not. allocated(self%time)) return
    n = size(self%time)
    largest = maxval(abs(self%slope))
    do i = 1, n
      if (abs(self%slope(i) - self%slope(i - 1)) <= KINK * largest) cycle
      if (self%time(i) <= time + 1.0e-10_wp * max(abs(time), abs(self%time(n)))) cycle
      kink_time = self%time(i)
      return
    end do

  end function motion_table_next_kink

  pure subroutine motion_table_get_slopes(self, slopes)
    class(motion_table_t), intent(in) :: self
    real(wp), allocatable, intent(out) :: slopes(:)

    if (allocated(self%slope)) then
      ! With the bounds 1 to n, not those of its source
      allocate (slopes(size(self%slope)), source=self%slope)
    else
      allocate (slopes(1), source=0.0_wp)
    end if

  end subroutine motion_table_get_slopes

end module swage_motion_table
