!> Flow stress from measured points: linear between them, constant before the first and after the
!> last.
module swage_table_flow_stress
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  use swage_status, only: status_t
  use swage_table_file, only: COLUMN_NAME_LENGTH, table_file_read
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: table_flow_stress_t, table_flow_stress_create, table_flow_stress_from_group

  type, extends(flow_stress_t) :: table_flow_stress_t
    private
    !> Equivalent plastic strains, increasing [1]; shape (n).
    real(wp), allocatable :: strain(:)
    !> [stress]; shape (n).
    real(wp), allocatable :: stress(:)
  contains
    procedure :: evaluate_hardening => table_evaluate_hardening
  end type table_flow_stress_t

contains

  !> Make the law from a valid table: at least one point, strains increasing.
  pure subroutine table_flow_stress_create(strain, stress, flow_stress)
    !> [1]; shape (n).
    real(wp), intent(in) :: strain(:)
    !> [stress]; shape (n).
    real(wp), intent(in) :: stress(:)
    type(table_flow_stress_t), intent(out) :: flow_stress

    allocate (flow_stress%strain(size(strain)))
    allocate (flow_stress%stress(size(stress)))
    flow_stress%strain = strain
    flow_stress%stress = stress
    ! A single point is meant for all strains
    if (size(strain) > 1) flow_stress%largest_strain = strain(size(strain))

  end subroutine table_flow_stress_create

  !> Make the law from its keys in a group `&flow_stress`; faults stay in `group`.
  !>
  !> The table stands in the lists `strain` and `stress`, or in a file of two columns that every
  !> rank reads, so it must lie where all of them see it.
  subroutine table_flow_stress_from_group(group, sources, flow_stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    character(len=:), allocatable :: file
    real(wp), allocatable :: strain(:), stress(:)
    type(table_flow_stress_t) :: made

    call group%take_list('strain', strain, '1', 'Equivalent plastic strains of the table, ' &
                         //'increasing.', lower=0.0_wp)
    call group%take_list('stress', stress, 'stress', 'Flow stresses of the table, as many as ' &
                         //'strains.', lower=0.0_wp)
    call group%take('file', file, 'CSV file with columns named strain and stress, instead of ' &
                    //'the two lists; relative to the folder of the input file.', required=.false.)
    call made%take_softening(group)
    if (group%explaining .or. group%status%failed()) return

    if (file /= '') then
      call read_columns(group, sources, file, strain, stress)
    else if (size(strain) == 0) then
      call group%refuse('strain', 'must be given, with stress, or else file')
    end if
    if (.not. group%status%failed()) call check_table(group, sources, file, strain, stress)
    if (group%status%failed()) return

    made%strain = strain
    made%stress = stress
    if (size(strain) > 1) made%largest_strain = strain(size(strain))
    allocate (flow_stress, source=made)

  end subroutine table_flow_stress_from_group

  !> Both columns of a file.
  subroutine read_columns(group, sources, file, strain, stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    character(len=*), intent(in) :: file
    !> As taken from the group on entry, where they must not be given.
    real(wp), allocatable, intent(inout) :: strain(:), stress(:)

    character(len=COLUMN_NAME_LENGTH), allocatable :: names(:)
    real(wp), allocatable :: values(:, :)
    type(status_t) :: outcome
    integer :: strain_column, stress_column

    if (size(strain) > 0 .or. size(stress) > 0) then
      call group%refuse('file', 'give either file or strain and stress')
      return
    end if
    call table_file_read(sources%deck%resolve(file), names, values, outcome)
    if (outcome%failed()) then
      call group%refuse('file', trim(outcome%message))
      return
    end if
    strain_column = findloc(names, 'strain', dim=1)
    stress_column = findloc(names, 'stress', dim=1)
    if (strain_column == 0 .or. stress_column == 0) then
      call group%refuse('file', 'must have columns named strain and stress')
      return
    end if
    deallocate (strain, stress)
    allocate (strain, source=values(:, strain_column))
    allocate (stress, source=values(:, stress_column))

  end subroutine read_columns

  !> Refuse a table that is no function of the strain.
  subroutine check_table(group, sources, file, strain, stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    !> Empty when the lists stand in the group.
    character(len=*), intent(in) :: file
    real(wp), intent(in) :: strain(:)
    real(wp), intent(in) :: stress(:)

    character(len=:), allocatable :: strain_key, stress_key
    integer :: i

    strain_key = 'strain'
    stress_key = 'stress'
    if (file /= '') then
      strain_key = 'file'
      stress_key = 'file'
    end if

    if (size(strain) /= size(stress)) then
      call group%refuse('stress', text(size(stress))//' values for '//text(size(strain))// &
                        ' of strain: must be as many')
      return
    end if
    if (any(strain < 0.0_wp)) call group%refuse(strain_key, 'a strain is negative')
    if (any(stress < 0.0_wp)) call group%refuse(stress_key, 'a stress is negative')
    do i = 2, size(strain)
      if (strain(i) > strain(i - 1)) cycle
      call group%refuse(strain_key, 'value '//text(i)//', '//text(strain(i))// &
                        ', is not above the one before, '//text(strain(i - 1))// &
                        ': strains must increase')
      return
    end do
    call sources%check_stress(group, stress_key, maxval(stress), 1.0e4_wp)

  end subroutine check_table

  pure subroutine table_evaluate_hardening(self, points)
    class(table_flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    integer :: i

    do i = 1, points%n_point
      call interpolate(self, points%strain(i), points%stress(i), points%by_strain(i))
    end do

  end subroutine table_evaluate_hardening

  !> Stress and slope at one strain.
  pure subroutine interpolate(self, equivalent_strain, stress, slope)
    type(table_flow_stress_t), intent(in) :: self
    real(wp), intent(in) :: equivalent_strain
    real(wp), intent(out) :: stress
    real(wp), intent(out) :: slope

    integer :: high, low, middle

    slope = 0.0_wp
    low = 1
    high = size(self%strain)
    if (equivalent_strain < self%strain(low)) then
      stress = self%stress(low)
      return
    else if (equivalent_strain >= self%strain(high)) then
      stress = self%stress(high)
      return
    end if

    ! strain(low) <= equivalent_strain < strain(high)
    do while (high - low > 1)
      middle = (low + high) / 2
      if (self%strain(middle) <= equivalent_strain) then
        low = middle
      else
        high = middle
      end if
    end do
    slope = (self%stress(high) - self%stress(low)) / (self%strain(high) - self%strain(low))
    stress = self%stress(low) + slope * (equivalent_strain - self%strain(low))

  end subroutine interpolate

end module swage_table_flow_stress
