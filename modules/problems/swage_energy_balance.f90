!> Where the work done on a body goes, summed up over a run.
module swage_energy_balance
  use swage_kinds, only: wp
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: energy_balance_t

  !> All are sums over the body, of the full turn in axial symmetry and per unit thickness in plane
  !> strain [energy]; the same on all ranks.
  type :: energy_balance_t
    !> Work of tools, prescribed motions and loads.
    real(wp) :: external = 0.0_wp
    !> Stored in the cells now.
    real(wp) :: elastic = 0.0_wp
    !> Plastic and viscous work.
    real(wp) :: plastic = 0.0_wp
    !> Work of friction where bodies slide.
    real(wp) :: friction = 0.0_wp
    !> In the springs of the contact: penalties, bonds that stick.
    real(wp) :: contact = 0.0_wp
    !> Work of what stabilises the element: bubbles and grad-div term.
    real(wp) :: stabilisation = 0.0_wp
    !> Largest size of the external work so far.
    real(wp) :: largest = 0.0_wp
    !> Energies below this are rounding, positive.
    real(wp) :: least = tiny(1.0_wp)
  contains
    !> External work that the other energies do not account for, by the largest external work [1].
    procedure :: error => energy_balance_error
    !> Add the works of a step, and set the elastic energy at its end.
    procedure :: add => energy_balance_add
    !> Put the sums into a snapshot, or take them out of one.
    procedure :: save => energy_balance_save
    procedure :: load => energy_balance_load
  end type energy_balance_t

contains

  pure function energy_balance_error(self) result(error)
    class(energy_balance_t), intent(in) :: self
    real(wp) :: error

    error = self%external &
      - (self%elastic + self%plastic + self%friction + self%contact + self%stabilisation)
    error = error / max(self%largest, self%least)

  end function energy_balance_error

  pure subroutine energy_balance_add(self, step)
    class(energy_balance_t), intent(inout) :: self
    !> Works of the step; the elastic energy is that of its end.
    type(energy_balance_t), intent(in) :: step

    self%external = self%external + step%external
    self%elastic = step%elastic
    self%plastic = self%plastic + step%plastic
    self%friction = self%friction + step%friction
    self%contact = self%contact + step%contact
    self%stabilisation = self%stabilisation + step%stabilisation
    self%largest = max(self%largest, abs(self%external))

  end subroutine energy_balance_add

  pure subroutine energy_balance_save(self, snapshot)
    class(energy_balance_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('external work', self%external)
    call snapshot%put('largest external work', self%largest)
    call snapshot%put('elastic energy', self%elastic)
    call snapshot%put('plastic work', self%plastic)
    call snapshot%put('friction work', self%friction)
    call snapshot%put('contact energy', self%contact)
    call snapshot%put('stabilisation work', self%stabilisation)

  end subroutine energy_balance_save

  pure subroutine energy_balance_load(self, snapshot, status)
    class(energy_balance_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` when one is missing.
    type(status_t), intent(inout) :: status

    call snapshot%get('external work', self%external, status)
    call snapshot%get('largest external work', self%largest, status)
    call snapshot%get('elastic energy', self%elastic, status)
    call snapshot%get('plastic work', self%plastic, status)
    call snapshot%get('friction work', self%friction, status)
    call snapshot%get('contact energy', self%contact, status)
    call snapshot%get('stabilisation work', self%stabilisation, status)

  end subroutine energy_balance_load

end module swage_energy_balance
