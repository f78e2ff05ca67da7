!> A law of another kind that fails in one cell when the step is too long.
module swage_test_brittle_law
  use swage_kinds, only: gp, wp
  use swage_material_law, only: material_law_t
  use swage_point_batch, only: point_batch_t
  implicit none(type, external)
  private

  public :: make_brittle

  type, extends(material_law_t) :: brittle_law_t
    private
    class(material_law_t), allocatable :: sound
    integer(gp) :: cell = 0_gp
    real(wp) :: longest = 0.0_wp
  contains
    procedure :: update => brittle_update
  end type brittle_law_t

contains

  !> Make a law fail.
  subroutine make_brittle(cell, longest, law)
    !> Global number of the cell.
    integer(gp), intent(in) :: cell
    !> Longest step that succeeds [time].
    real(wp), intent(in) :: longest
    class(material_law_t), allocatable, intent(inout) :: law

    type(brittle_law_t) :: brittle

    brittle%label = 'brittle'
    brittle%cell = cell
    brittle%longest = longest
    brittle%inverse_bulk_modulus = law%inverse_bulk_modulus
    brittle%reference_modulus = law%reference_modulus
    brittle%initial_relaxation = law%initial_relaxation
    brittle%initial_flow_stress = law%initial_flow_stress
    call brittle%publish_state(law%state_table)
    call move_alloc(law, brittle%sound)
    allocate (law, source=brittle)

  end subroutine make_brittle

  subroutine brittle_update(self, batch, n_failed)
    class(brittle_law_t), intent(in) :: self
    type(point_batch_t), intent(inout) :: batch
    integer, intent(out) :: n_failed

    integer :: i

    call self%sound%update(batch, n_failed)
    if (batch%dt <= self%longest) return
    do i = 1, batch%n_point
      if (batch%cell(i) /= self%cell) cycle
      n_failed = n_failed + 1
      call batch%fail(i, 'it breaks')
    end do

  end subroutine brittle_update

end module swage_test_brittle_law
