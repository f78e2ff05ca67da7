!> Flow stress measured on a grid of strains, strain rates and temperatures.
!>
!> Between the points of the grid it is linear in the strain, in the logarithm of the rate and in
!> the temperature: monotone where the table is, continuous, and with derivatives that are those of
!> the interpolation. Outside it is constant in the direction that leaves the grid, with a
!> derivative of 0; at a point of the grid the derivative is that ahead.
!>
!> Power laws are lines in the logarithms of stress and rate, so the error of the interpolation
!> is the least with rates at equal ratios.
module swage_grid_flow_stress
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  use swage_number, only: number_text
  use swage_sort, only: last_not_above
  use swage_status, only: status_t
  use swage_table_file, only: COLUMN_NAME_LENGTH, table_file_read
  use swage_text, only: text
  use swage_units, only: shown, taken
  implicit none(type, external)
  private

  public :: grid_flow_stress_t, grid_flow_stress_create, grid_flow_stress_from_group

  !> Columns of the file, in the order of the module's arrays.
  character(len=11), parameter :: COLUMNS(*) = [character(len=11) :: 'strain', 'rate', &
                                                'temperature', 'stress']
  integer, parameter :: OF_STRAIN = 1
  integer, parameter :: OF_RATE = 2
  integer, parameter :: OF_TEMPERATURE = 3
  integer, parameter :: OF_STRESS = 4

  type, extends(flow_stress_t) :: grid_flow_stress_t
    private
    !> Equivalent plastic strains [1], logarithms of their rates [1/time], kelvin, all increasing
    !> [temperature].
    real(wp), allocatable :: strain(:), log_rate(:), temperature(:)
    !> [stress]; shape (strains, rates, temperatures).
    real(wp), allocatable :: stress(:, :, :)
  contains
    procedure :: evaluate_hardening => grid_evaluate_hardening
  end type grid_flow_stress_t

  !> Where a value lies among increasing ones.
  type :: place_t
    !> The values around it; the same where the table goes on constant.
    integer :: low = 1
    integer :: high = 1
    !> Its way from one to the other [1], and the change of that per unit of the value.
    real(wp) :: share = 0.0_wp
    real(wp) :: slope = 0.0_wp
  end type place_t

contains

  !> Make the law from a valid grid: at least one value in each direction, all increasing.
  pure subroutine grid_flow_stress_create(strain, rate, temperature, stress, flow_stress)
    !> [1], at least 0.
    real(wp), intent(in) :: strain(:)
    !> [1/time], positive.
    real(wp), intent(in) :: rate(:)
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature(:)
    !> [stress]; shape (strains, rates, temperatures).
    real(wp), intent(in) :: stress(:, :, :)
    type(grid_flow_stress_t), intent(out) :: flow_stress

    allocate (flow_stress%strain, source=strain)
    allocate (flow_stress%log_rate, source=log(rate))
    allocate (flow_stress%temperature, source=temperature)
    allocate (flow_stress%stress, source=stress)
    ! A single value is meant for all
    if (size(strain) > 1) flow_stress%largest_strain = strain(size(strain))
    if (size(rate) > 1) flow_stress%largest_rate = rate(size(rate))
    flow_stress%lowest_temperature = temperature(1)
    flow_stress%highest_temperature = temperature(size(temperature))
    flow_stress%reference_temperature = 0.5_wp * (temperature(1) + temperature(size(temperature)))
    flow_stress%starting_rate = rate(1)

  end subroutine grid_flow_stress_create

  !> Make the law from its keys in a group `&flow_stress`; faults stay in `group`. Every rank reads
  !> the file.
  subroutine grid_flow_stress_from_group(group, sources, flow_stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    character(len=:), allocatable :: file
    real(wp), allocatable :: rate(:), rows(:, :), strain(:), stress(:, :, :), temperature(:)
    type(grid_flow_stress_t) :: made

    call group%take('file', file, 'CSV file with columns named strain, rate, temperature (degC) ' &
                    //'and stress: a line for each point of the grid, in any order; relative to ' &
                    //'the folder of the input file.', required=.true.)
    if (group%explaining .or. group%status%failed()) return
    call read_rows(group, sources, file, rows)
    if (group%status%failed()) return
    call check_rows(group, sources, rows)
    if (group%status%failed()) return
    call find_distinct(rows(:, OF_STRAIN), strain)
    call find_distinct(rows(:, OF_RATE), rate)
    call find_distinct(rows(:, OF_TEMPERATURE), temperature)
    call arrange(group, rows, strain, rate, temperature, stress)
    if (group%status%failed()) return
    call check_rates(group, strain, rate, temperature, stress)
    if (group%status%failed()) return

    call grid_flow_stress_create(strain, rate, temperature, stress, made)
    allocate (flow_stress, source=made)

  end subroutine grid_flow_stress_from_group

  !> The four columns, the temperature in kelvin.
  subroutine read_rows(group, sources, file, rows)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    character(len=*), intent(in) :: file
    !> Shape (rows, columns); none where there is a fault.
    real(wp), allocatable, intent(out) :: rows(:, :)

    character(len=COLUMN_NAME_LENGTH), allocatable :: names(:)
    real(wp), allocatable :: values(:, :)
    type(status_t) :: outcome
    integer :: i, place

    allocate (rows(0, size(COLUMNS)))
    call table_file_read(sources%deck%resolve(file), names, values, outcome)
    if (outcome%failed()) then
      call group%refuse('file', trim(outcome%message))
      return
    end if
    deallocate (rows)
    allocate (rows(size(values, 1), size(COLUMNS)))
    do i = 1, size(COLUMNS)
      place = findloc(names, COLUMNS(i), dim=1)
      if (place == 0) then
        call group%refuse('file', 'has no column '//trim(COLUMNS(i))//': the columns must be ' &
                          //'named strain, rate, temperature and stress')
        return
      end if
      rows(:, i) = values(:, place)
    end do
    rows(:, OF_TEMPERATURE) = taken(rows(:, OF_TEMPERATURE), 'temperature')

  end subroutine read_rows

  !> Refuse values that no metal has.
  subroutine check_rows(group, sources, rows)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    real(wp), intent(in) :: rows(:, :)

    if (any(rows(:, OF_STRAIN) < 0.0_wp)) call group%refuse('file', 'a strain is negative')
    if (any(rows(:, OF_RATE) <= 0.0_wp)) then
      call group%refuse('file', 'a rate is not above 0, as its logarithm needs')
    end if
    if (any(rows(:, OF_TEMPERATURE) <= 0.0_wp)) then
      call group%refuse('file', 'a temperature is not above absolute zero, -273.15')
    end if
    if (any(rows(:, OF_STRESS) <= 0.0_wp)) call group%refuse('file', 'a stress is not above 0')
    call sources%check_stress(group, 'file', maxval(rows(:, OF_STRESS)), 1.0e4_wp)

  end subroutine check_rows

  !> The values of a column, each once, increasing.
  pure subroutine find_distinct(column, values)
    real(wp), intent(in) :: column(:)
    real(wp), allocatable, intent(out) :: values(:)

    real(wp) :: sorted(size(column))
    integer :: i, n, place

    n = 0
    do i = 1, size(column)
      place = 0
      if (n > 0) place = last_not_above(sorted(:n), column(i))
      if (place > 0) then
        if (.not. sorted(place) < column(i)) cycle
      end if
      sorted(place + 2:n + 1) = sorted(place + 1:n)
      sorted(place + 1) = column(i)
      n = n + 1
    end do
    allocate (values, source=sorted(:n))

  end subroutine find_distinct

  !> Put each stress at its point; refuse a table with a point twice or without one.
  subroutine arrange(group, rows, strain, rate, temperature, stress)
    type(group_t), intent(inout) :: group
    real(wp), intent(in) :: rows(:, :)
    real(wp), intent(in) :: strain(:), rate(:), temperature(:)
    !> Shape (strains, rates, temperatures).
    real(wp), allocatable, intent(out) :: stress(:, :, :)

    integer :: i, j, k, place(3)

    ! A column that repeats nothing is no side of a grid: its grid would not fit the memory
    if (real(size(strain), wp) * size(rate) * size(temperature) &
        > 2.0_wp * size(rows, 1) + 64.0_wp) then
      call group%refuse('file', text(size(strain))//' strains, '//text(size(rate))// &
                        ' rates and '//text(size(temperature))//' temperatures in '// &
                        text(size(rows, 1))//' lines: every strain must stand with every rate ' &
                        //'and temperature')
      return
    end if
    allocate (stress(size(strain), size(rate), size(temperature)), source=-1.0_wp)
    do i = 1, size(rows, 1)
      place = [last_not_above(strain, rows(i, OF_STRAIN)), last_not_above(rate, rows(i, OF_RATE)), &
               last_not_above(temperature, rows(i, OF_TEMPERATURE))]
      associate (value => stress(place(1), place(2), place(3)))
        if (value > 0.0_wp) then
          call group%refuse('file', point_name(strain(place(1)), rate(place(2)), &
                                               temperature(place(3)))//' stands there twice')
          return
        end if
        value = rows(i, OF_STRESS)
      end associate
    end do
    do k = 1, size(temperature)
      do j = 1, size(rate)
        do i = 1, size(strain)
          if (stress(i, j, k) > 0.0_wp) cycle
          call group%refuse('file', 'there is no stress for '// &
                            point_name(strain(i), rate(j), temperature(k))//': every strain must ' &
                            //'stand with every rate and temperature')
          return
        end do
      end do
    end do

  end subroutine arrange

  !> Refuse a stress that falls with the rate: the increment of a step would not be unique.
  subroutine check_rates(group, strain, rate, temperature, stress)
    type(group_t), intent(inout) :: group
    real(wp), intent(in) :: strain(:), rate(:), temperature(:)
    real(wp), intent(in) :: stress(:, :, :)

    integer :: i, j, k

    do k = 1, size(temperature)
      do j = 2, size(rate)
        do i = 1, size(strain)
          if (stress(i, j, k) >= stress(i, j - 1, k)) cycle
          call group%refuse('file', 'the stress falls from '//number_text(stress(i, j - 1, k))// &
                            ' at rate '//number_text(rate(j - 1))//' to '// &
                            number_text(stress(i, j, k))//' for '// &
                            point_name(strain(i), rate(j), temperature(k))// &
                            ': it may not fall with the rate')
          return
        end do
      end do
    end do

  end subroutine check_rates

  !> `strain 0.1, rate 1, temperature 900`.
  pure function point_name(strain, rate, temperature) result(name)
    real(wp), intent(in) :: strain, rate
    !> Kelvin.
    real(wp), intent(in) :: temperature
    character(len=:), allocatable :: name

    ! To a millionth: what kelvin have rounded
    name = 'strain '//number_text(strain)//', rate '//number_text(rate)//', temperature '// &
      number_text(1.0e-6_wp * anint(1.0e6_wp * shown(temperature, 'temperature')))

  end function point_name

  pure subroutine grid_evaluate_hardening(self, points)
    class(grid_flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    real(wp) :: above, below, by_strain, first, second
    type(place_t) :: rate, strain, temperature
    integer :: i

    do i = 1, points%n_point
      call find_place(self%strain, points%strain(i), strain)
      call find_place(self%temperature, points%temperature(i), temperature)
      rate = place_t()
      if (points%rate(i) > 0.0_wp) call find_place(self%log_rate, log(points%rate(i)), rate)

      call interpolate(self, strain, rate%low, temperature, below, first)
      call interpolate(self, strain, rate%high, temperature, above, second)
      by_strain = first + rate%share * (second - first)
      points%stress(i) = below + rate%share * (above - below)
      points%by_strain(i) = by_strain
      if (rate%slope > 0.0_wp) then
        points%by_rate(i) = rate%slope * (above - below) / points%rate(i)
      end if
    end do

  end subroutine grid_evaluate_hardening

  !> Stress at one rate of the table, and its slope by the strain.
  pure subroutine interpolate(self, strain, rate, temperature, stress, slope)
    type(grid_flow_stress_t), intent(in) :: self
    type(place_t), intent(in) :: strain
    integer, intent(in) :: rate
    type(place_t), intent(in) :: temperature
    real(wp), intent(out) :: stress
    real(wp), intent(out) :: slope

    real(wp) :: high, low

    low = self%stress(strain%low, rate, temperature%low)
    low = low + temperature%share * (self%stress(strain%low, rate, temperature%high) - low)
    high = self%stress(strain%high, rate, temperature%low)
    high = high + temperature%share * (self%stress(strain%high, rate, temperature%high) - high)
    stress = low + strain%share * (high - low)
    slope = strain%slope * (high - low)

  end subroutine interpolate

  !> Where a value lies.
  pure subroutine find_place(values, value, place)
    !> Increasing.
    real(wp), intent(in) :: values(:)
    real(wp), intent(in) :: value
    type(place_t), intent(out) :: place

    place%low = max(1, last_not_above(values, value))
    place%high = place%low
    if (value < values(1) .or. place%low == size(values)) return
    place%high = place%low + 1
    place%slope = 1.0_wp / (values(place%high) - values(place%low))
    place%share = (value - values(place%low)) * place%slope

  end subroutine find_place

end module swage_grid_flow_stress
