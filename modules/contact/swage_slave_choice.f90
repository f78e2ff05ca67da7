!> Which of two surfaces is the slave of their contact.
!>
!> Conditions are those of the slave: of one coarser than the master they are too few, and nodes of
!> the master pass between them. So the finer surface is the slave; of surfaces about as fine, that
!> of the softer body, which gives way; of equals the first.
module swage_slave_choice
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_surface, only: contact_surface_t
  use swage_kinds, only: wp
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: contact_side_t, choose_slave, measure_sides, warn_of_coarse_slave

  !> Facets are about as fine up to this ratio, and bodies as stiff.
  real(wp), parameter :: ABOUT_AS_FINE = 1.25_wp
  real(wp), parameter :: ABOUT_AS_STIFF = 1.01_wp
  !> Ratio of sizes from which a slave is much coarser.
  real(wp), parameter :: MUCH_COARSER = 1.5_wp

  !> A surface where it meets the other one.
  type :: contact_side_t
    !> As the user calls it.
    character(len=:), allocatable :: name
    !> Mean of its facets [length].
    real(wp) :: size = 0.0_wp
    !> Mean of its material [stress].
    real(wp) :: modulus = 0.0_wp
  end type contact_side_t

contains

  !> Measure both surfaces of a pair, whole where they do not meet.
  pure subroutine measure_sides(pair, modulus, slave, master)
    !> At the start of a step.
    type(contact_pair_t), intent(in) :: pair
    !> Of the surface nodes [stress]; shape (n_node).
    real(wp), intent(in) :: modulus(:)
    type(contact_side_t), intent(inout) :: slave
    type(contact_side_t), intent(inout) :: master

    call measure(pair%slave, modulus, slave)
    call measure(pair%master, modulus, master)

  end subroutine measure_sides

  pure subroutine measure(surface, modulus, side)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: modulus(:)
    type(contact_side_t), intent(inout) :: side

    real(wp) :: area, share(surface%n_facet)
    integer :: f

    share = surface%share
    if (.not. any(share > 0.0_wp)) share = 1.0_wp
    area = 0.0_wp
    side%modulus = 0.0_wp
    do f = 1, surface%n_facet
      area = area + share(f) * surface%extent(f)
      side%modulus = side%modulus + share(f) * surface%extent(f) &
        * sum(modulus(surface%facet(:, f))) / surface%n_dim
    end do
    side%modulus = side%modulus / area
    side%size = area / sum(share)
    if (surface%n_dim == 3) side%size = sqrt(side%size)

  end subroutine measure

  !> Choose the slave, and say why.
  pure subroutine choose_slave(sides, slave, reason)
    type(contact_side_t), intent(in) :: sides(2)
    !> 1 or 2.
    integer, intent(out) :: slave
    character(len=:), allocatable, intent(out) :: reason

    integer :: master

    slave = minloc(sides%size, dim=1)
    if (maxval(sides%size) > ABOUT_AS_FINE * minval(sides%size)) then
      master = 3 - slave
      reason = 'the slave is '//sides(slave)%name//', the finer side: its facets measure '// &
        text(sides(slave)%size)//' [length], those of '//sides(master)%name//' '// &
        text(sides(master)%size)
    else if (maxval(sides%modulus) > ABOUT_AS_STIFF * minval(sides%modulus)) then
      slave = minloc(sides%modulus, dim=1)
      reason = 'the slave is '//sides(slave)%name//', the softer side: the facets of both are '// &
        'about as fine, '//text(sides(1)%size)//' and '//text(sides(2)%size)//' [length]'
    else
      slave = 1
      reason = 'the slave is '//sides(slave)%name//', which is named first: both sides are alike'
    end if

  end subroutine choose_slave

  !> What speaks against a slave that the user has chosen.
  pure subroutine warn_of_coarse_slave(slave, master, warning)
    type(contact_side_t), intent(in) :: slave
    type(contact_side_t), intent(in) :: master
    !> Empty when nothing does.
    character(len=:), allocatable, intent(out) :: warning

    warning = ''
    if (slave%size <= MUCH_COARSER * master%size) return
    warning = 'the facets of the slave, '//slave%name//', measure '//text(slave%size)// &
      ' [length], those of the master, '//master%name//', '//text(master%size)//': nodes of '// &
      'the master may pass between those of the slave; exchange slave and master, name both by '// &
      'bodies, or take formulation = ''quasi_symmetric'''

  end subroutine warn_of_coarse_slave

end module swage_slave_choice
