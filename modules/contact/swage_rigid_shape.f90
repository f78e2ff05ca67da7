!> Surfaces of rigid tools, in the frame of the tool.
module swage_rigid_shape
  use swage_comm, only: comm_t
  use swage_kinds, only: wp
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: rigid_shape_t, shape_context_t, DIRECTION_TOLERANCE, is_along, vector_text

  !> A component of a unit vector below this is taken for zero.
  real(wp), parameter :: DIRECTION_TOLERANCE = 1.0e-10_wp

  !> What a shape is made for: the maker of a shape takes what it needs.
  type :: shape_context_t
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=:), allocatable :: dimension
    !> Folder of the input file, ended by `/`; paths in it start there.
    character(len=:), allocatable :: folder
    !> The ranks, which all make the same shape.
    type(comm_t) :: comm
  contains
    !> A path given in the input file, as seen from where the program runs.
    procedure :: resolve => shape_context_resolve
  end type shape_context_t

  !> The surface of a tool; immutable once created.
  !>
  !> Positions have three components in every dimension: (x, y, 0) in plane strain, (r, z, 0) in an
  !> axisymmetric problem, whose axis of revolution is therefore the second axis, y. A shape made
  !> for a two-dimensional problem is one whose normals have no third component there.
  type, abstract :: rigid_shape_t
    !> What the key `shape` calls it.
    character(len=:), allocatable :: name
    !> What the log tells about it; not allocated when there is nothing to tell.
    character(len=:), allocatable :: note
    !> A point of the tool's frame that moments may refer to [length].
    real(wp) :: anchor(3) = 0.0_wp
  contains
    !> How far a point is inside the tool, and which way is out.
    procedure(project_point), deferred :: project
  end type rigid_shape_t

  abstract interface
    !> Penetration of a point, with its derivatives.
    !>
    !> Penetration is the distance to the surface with the sign of the inside. Its gradient is
    !> -`normal`, its second derivative `hessian` = -∂normal/∂x. Where the closest point is not
    !> unique (centre, axis) `normal` is one of the candidates and `hessian` zero.
    pure subroutine project_point(self, x, penetration, normal, hessian)
      import :: rigid_shape_t, wp
      implicit none(type, external)
      class(rigid_shape_t), intent(in) :: self
      !> Position in the tool's frame [length].
      real(wp), intent(in) :: x(3)
      !> [length], positive inside the tool.
      real(wp), intent(out) :: penetration
      !> Unit vector out of the tool at the closest point of its surface.
      real(wp), intent(out) :: normal(3)
      !> [1/length], symmetric.
      real(wp), intent(out) :: hessian(3, 3)
    end subroutine project_point
  end interface

contains

  !> Relative paths start at the folder of the input file.
  pure function shape_context_resolve(self, path) result(resolved)
    class(shape_context_t), intent(in) :: self
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: resolved

    resolved = path
    if (index(path, '/') /= 1 .and. allocated(self%folder)) resolved = self%folder//path

  end function shape_context_resolve

  !> True when a unit vector is along a coordinate axis, either way.
  pure function is_along(unit, axis) result(along)
    real(wp), intent(in) :: unit(3)
    !> 1, 2 or 3.
    integer, intent(in) :: axis
    logical :: along

    real(wp) :: across(3)

    across = unit
    across(axis) = 0.0_wp
    along = maxval(abs(across)) <= DIRECTION_TOLERANCE .and. abs(unit(axis)) > 0.5_wp

  end function is_along

  !> A vector in a message: `(1.0, 0.0, 0.0)`.
  pure function vector_text(vector) result(string)
    real(wp), intent(in) :: vector(3)
    character(len=:), allocatable :: string

    string = '('//text(vector(1))//', '//text(vector(2))//', '//text(vector(3))//')'

  end function vector_text

end module swage_rigid_shape
