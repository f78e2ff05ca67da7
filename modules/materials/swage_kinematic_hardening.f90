!> Linear kinematic hardening: the yield surface moves with the plastic strain.
!>
!> Its centre is the back stress \(\alpha\), a deviator of the history, with the Jaumann rate
!> \[ \overset{\circ}{\alpha} = \tfrac23 C\, \dot\varepsilon^p, \]
!> so that \(C\) is its slope in tension. The law answers for the relative stress
!> \(\xi = s - \alpha\): with \(\xi^{tr} = s^{tr} - \alpha_n\), the increment \(x\) of the
!> equivalent plastic strain and \(\theta = 1 - 3G x / q^{tr}\) of [[swage_radial_return]],
!> \[ s = \alpha_n + \theta\, \xi^{tr}, \qquad
!>    \alpha_{n+1} = \alpha_n + C x\, \xi^{tr} / q^{tr}. \]
!>
!> Sources: W. Prager, A new method of analyzing stresses and strains in work-hardening plastic
!> solids, J. Appl. Mech. 23 (1956) 493–496; J. C. Simo and T. J. R. Hughes, Computational
!> Inelasticity (1998), box 3.1.
module swage_kinematic_hardening
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_law, only: PLASTIC_STATE
  use swage_material_sources, only: material_sources_t
  use swage_point_batch, only: LANES, point_batch_t
  use swage_state_table, only: state_variable_t, STATE_TENSOR2
  implicit none(type, external)
  private

  public :: kinematic_hardening_t, put_back_stress, take_back_stress, KINEMATIC_STATE

  !> History of a law that hardens so.
  type(state_variable_t), parameter :: KINEMATIC_STATE(*) = [ &
    PLASTIC_STATE, &
    state_variable_t('back_stress', 'stress', kind=STATE_TENSOR2)]

  !> First row of the back stress.
  integer, parameter :: ROW_BACK = size(PLASTIC_STATE) + 1

  type :: kinematic_hardening_t
    !> \(C\) [stress]; 0 for a law without a back stress, which calls nothing of this.
    real(wp) :: modulus = 0.0_wp
  contains
    !> Name, read and check the key.
    procedure :: take => kinematic_hardening_take
  end type kinematic_hardening_t

contains

  subroutine kinematic_hardening_take(self, group, sources)
    class(kinematic_hardening_t), intent(inout) :: self
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources

    call group%take('kinematic_modulus', self%modulus, 'stress', &
                    'Linear kinematic hardening C: rise of the back stress per unit of plastic ' &
                    //'strain in tension.', lower=0.0_wp)
    call sources%check_stress(group, 'kinematic_modulus', self%modulus, 1.0e4_wp)

  end subroutine kinematic_hardening_take

  !> Take the back stress off the trial stress.
  pure subroutine take_back_stress(first, n, batch, trial)
    !> First point, and how many.
    integer, intent(in) :: first, n
    type(point_batch_t), intent(inout) :: batch
    !> Trial stress on entry, then without the old back stress [stress].
    real(wp), intent(inout) :: trial(LANES, 6)

    integer :: i, k

    batch%has_back_stress = .true.
    do k = 1, 6
      do i = 1, n
        batch%back_stress(first + i - 1, k) = batch%state_old(first + i - 1, ROW_BACK + k - 1)
        trial(i, k) = trial(i, k) - batch%back_stress(first + i - 1, k)
      end do
    end do

  end subroutine take_back_stress

  !> Complete results that are those of the relative stress on entry.
  pure subroutine put_back_stress(kinematic, first, n, trial, equivalent, increment, batch)
    type(kinematic_hardening_t), intent(in) :: kinematic
    integer, intent(in) :: first, n
    !> \(\xi^{tr}\) and \(q^{tr}\) [stress].
    real(wp), intent(in) :: trial(LANES, 6)
    real(wp), intent(in) :: equivalent(LANES)
    !> \(x\) [1].
    real(wp), intent(in) :: increment(LANES)
    type(point_batch_t), intent(inout) :: batch

    real(wp) :: share(LANES)
    integer :: i, k

    do i = 1, n
      share(i) = kinematic%modulus * increment(i) &
        / merge(equivalent(i), 1.0_wp, equivalent(i) > 0.0_wp)
      ! Heat is what the relative stress works
      batch%dissipated_power(first + i - 1) = batch%dissipated_power(first + i - 1) &
        - kinematic%modulus * increment(i)**2 / batch%dt
    end do
    do k = 1, 6
      do i = 1, n
        batch%deviatoric_stress(first + i - 1, k) = batch%deviatoric_stress(first + i - 1, k) &
          + batch%back_stress(first + i - 1, k)
        batch%state_new(first + i - 1, ROW_BACK + k - 1) = batch%back_stress(first + i - 1, k) &
          + share(i) * trial(i, k)
      end do
    end do

  end subroutine put_back_stress

end module swage_kinematic_hardening
