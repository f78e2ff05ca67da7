!> What every friction law offers.
module swage_friction
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: friction_law_t, friction_point_t, shear_limit

  !> One point in contact, during one step. Slip and old traction are those of the tangent plane at
  !> the end of the step, but a law takes any vector.
  !>
  !> An input that a law does not use may keep its initial value.
  type :: friction_point_t
    !> In: slip of the body relative to the tool during the step [length].
    real(wp) :: slip(3) = 0.0_wp
    !> In: the step [time], positive.
    real(wp) :: dt = 1.0_wp
    !> In: contact pressure at the end of the step [stress]; tension counts as 0.
    real(wp) :: pressure = 0.0_wp
    !> In: flow stress σ₀ of the material at the point [stress].
    real(wp) :: flow_stress = 0.0_wp
    !> In: slip rate below which the traction of a regularised law fades [length/time], positive.
    real(wp) :: regularisation_velocity = 0.0_wp
    !> In: stiffness against slip of a law with an elastic bond [stress/length], positive.
    real(wp) :: tangential_stiffness = 0.0_wp
    !> In: traction at the start of the step, turned with the tool [stress].
    real(wp) :: traction_old(3) = 0.0_wp
    !> Out: friction on the body [stress].
    real(wp) :: traction(3) = 0.0_wp
    !> Out: ∂traction/∂slip at fixed pressure [stress/length].
    real(wp) :: d_slip(3, 3) = 0.0_wp
    !> Out: ∂traction/∂traction_old at fixed slip and pressure [1].
    real(wp) :: d_traction_old(3, 3) = 0.0_wp
    !> Set by the law to the size of the traction by the slip that makes it, at least 0: a safe
    !> stiffness, where ∂traction/∂slip vanishes along a slip at the limit [stress/length].
    real(wp) :: secant = 0.0_wp
    !> Out: ∂traction/∂pressure at fixed slip [1].
    real(wp) :: d_pressure(3) = 0.0_wp
    !> Out: work turned into heat during the step [energy/length^2], at least 0.
    real(wp) :: dissipation = 0.0_wp
    !> Out: true while the point follows the tool: below the regularising slip rate, or bonded.
    logical :: sticking = .false.
  end type friction_point_t

  !> A friction law with its parameters; immutable once created, shared by all points.
  type, abstract :: friction_law_t
    !> What the key `kind` calls it.
    character(len=:), allocatable :: name
    !> Slip rate of the regularisation as the user gave it [length/time]; 0: not given, the caller
    !> takes one per cent of the speed of the fastest tool.
    real(wp) :: regularisation_velocity = 0.0_wp
    !> True when the law asks for `friction_point_t%flow_stress`.
    logical :: uses_flow_stress = .false.
    !> True when the law asks for `friction_point_t%regularisation_velocity`.
    logical :: is_regularised = .false.
    !> True when the law asks for `traction_old` and `tangential_stiffness`.
    logical :: has_history = .false.
  contains
    !> Friction at one point.
    procedure(point_traction), deferred :: traction
  end type friction_law_t

  abstract interface
    !> Traction on the body and its derivatives, from the inputs of `point`.
    pure subroutine point_traction(self, point)
      import :: friction_law_t, friction_point_t
      implicit none(type, external)
      class(friction_law_t), intent(in) :: self
      type(friction_point_t), intent(inout) :: point
    end subroutine point_traction
  end interface

contains

  !> Share of the shear flow stress, \(m\,\sigma_0/\sqrt3\) [stress].
  elemental function shear_limit(tresca_factor, flow_stress) result(limit)
    !> \(m\) [1].
    real(wp), intent(in) :: tresca_factor
    !> \(\sigma_0\), uniaxial [stress].
    real(wp), intent(in) :: flow_stress
    real(wp) :: limit

    limit = tresca_factor * (flow_stress / sqrt(3.0_wp))

  end function shear_limit

end module swage_friction
