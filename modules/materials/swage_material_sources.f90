!> What a material may need besides its own group: the deck it stands in and the unit system.
module swage_material_sources
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_number, only: number_text
  implicit none(type, external)
  private

  public :: material_sources_t

  !> Largest stress anyone means, in MPa: nothing is stiffer than 1.2e6 MPa, the diamond.
  real(wp), parameter :: LARGEST_MPA = 1.0e7_wp

  !> Pascals in a megapascal.
  real(wp), parameter :: PASCAL = 1.0e6_wp

  type :: material_sources_t
    !> The deck, where other groups are found by name.
    type(deck_t) :: deck
    !> Name of the unit system, `&job units`.
    character(len=:), allocatable :: units
  contains
    !> Refuse a stress that only makes sense in another unit.
    procedure :: check_stress => material_sources_check_stress
  end type material_sources_t

contains

  !> Refuse a stress that only makes sense in another unit. Zero always passes.
  !>
  !> In mm, tonne, s a stress is a number of MPa and small values are plausible (unit tests, soft
  !> matter), so only large ones are refused; in SI it is a number of Pa and both are.
  subroutine material_sources_check_stress(self, group, key, value, smallest)
    class(material_sources_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: value
    !> Smallest plausible value in pascals.
    real(wp), intent(in) :: smallest

    if (group%explaining) return
    select case (self%units)
    case ('SI')
      if (value > 0.0_wp .and. value < smallest) then
        call group%refuse(key, 'implausibly small in Pa, the stress of units = ''SI'': if it is ' &
                          //'in MPa, write '//number_text(value * PASCAL)//'; if in GPa, '// &
                          number_text(value * 1.0e3_wp * PASCAL))
      else if (value > LARGEST_MPA * PASCAL) then
        call group%refuse(key, 'implausibly large in Pa, the stress of units = ''SI''')
      end if
    case ('mm-tonne-s')
      if (value > LARGEST_MPA) then
        call group%refuse(key, 'implausibly large in MPa, the stress of units = ''mm-tonne-s'': ' &
                          //'if it is in Pa, write '//number_text(value / PASCAL))
      end if
    case default
      ! No other system has a known stress
      return
    end select

  end subroutine material_sources_check_stress

end module swage_material_sources
