!> Surfaces of rigid tools, in the frame of the tool.
module swage_rigid_shape
  use swage_comm, only: comm_t
  use swage_kinds, only: wp
  use swage_rotation, only: cross_product, perpendicular
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: rigid_shape_t, shape_context_t, shape_picture_t, shape_view_t
  public :: DIRECTION_TOLERANCE, is_along, vector_text

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

  !> What a picture is to show: a cube around the bodies.
  type :: shape_view_t
    !> 2 or 3.
    integer :: n_dim = 3
    logical :: axisymmetric = .false.
    !> Middle of the cube and half its side, in the frame of the tool [length].
    real(wp) :: centre(3) = 0.0_wp
    real(wp) :: extent = 0.0_wp
  end type shape_view_t

  !> A surface as lines (2D) or triangles (3D).
  type :: shape_picture_t
    !> Shape (3, n_point) [length].
    real(wp), allocatable :: points(:, :)
    !> Places in `points`; shape (n_dim, n_cell).
    integer, allocatable :: cells(:, :)
  contains
    !> Drop what lies outside the view, and points that no cell uses.
    procedure :: crop => shape_picture_crop
  end type shape_picture_t

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
    !> The surface as far as it is in view, for pictures.
    procedure :: draw => rigid_shape_draw
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

  !> The points of a grid in a tangent plane, moved onto the surface along its normals. A shape
  !> with edges or ends draws itself.
  subroutine rigid_shape_draw(self, view, picture)
    class(rigid_shape_t), intent(in) :: self
    type(shape_view_t), intent(in) :: view
    type(shape_picture_t), intent(out) :: picture

    integer, parameter :: N_SIDE = 24

    integer :: i, j, n, n_second, place, step
    real(wp) :: first(3), hessian(3, 3), middle(3), normal(3), penetration, second(3), x(3)

    ! The tangent plane at the point nearest to the bodies' middle
    call self%project(view%centre, penetration, normal, hessian)
    middle = view%centre + penetration * normal
    if (view%n_dim == 2) then
      first = [-normal(2), normal(1), 0.0_wp]
      second = 0.0_wp
      n_second = 0
    else
      first = perpendicular(normal)
      second = cross_product(normal, first)
      n_second = N_SIDE
    end if
    allocate (picture%points(3, (N_SIDE + 1) * (n_second + 1)))
    do j = 0, n_second
      do i = 0, N_SIDE
        x = middle + first * view%extent * (2.0_wp * i / N_SIDE - 1.0_wp)
        if (n_second > 0) x = x + second * view%extent * (2.0_wp * j / n_second - 1.0_wp)
        if (view%axisymmetric) x(1) = max(x(1), 0.0_wp)
        do step = 1, 3
          call self%project(x, penetration, normal, hessian)
          x = x + penetration * normal
        end do
        picture%points(:, 1 + i + (N_SIDE + 1) * j) = x
      end do
    end do

    allocate (picture%cells(view%n_dim, max(1, 2 * n_second) * N_SIDE))
    n = 0
    do j = 0, max(n_second - 1, 0)
      do i = 0, N_SIDE - 1
        place = 1 + i + (N_SIDE + 1) * j
        if (view%n_dim == 2) then
          picture%cells(:, n + 1) = [place, place + 1]
          n = n + 1
        else
          picture%cells(:, n + 1) = [place, place + 1, place + N_SIDE + 2]
          picture%cells(:, n + 2) = [place, place + N_SIDE + 2, place + N_SIDE + 1]
          n = n + 2
        end if
      end do
    end do

  end subroutine rigid_shape_draw

  !> A cell is in view when the middle of its first two corners is, with some margin. (Both
  !> halves of a quadrangle are dropped or kept together if that is their common side.)
  pure subroutine shape_picture_crop(self, view)
    class(shape_picture_t), intent(inout) :: self
    type(shape_view_t), intent(in) :: view

    real(wp), parameter :: MARGIN = 1.6_wp

    integer :: i, k, n
    integer, allocatable :: place(:)
    real(wp) :: middle(3)
    real(wp), allocatable :: points(:, :)

    n = 0
    do i = 1, size(self%cells, 2)
      middle = 0.5_wp * (self%points(:, self%cells(1, i)) + self%points(:, self%cells(2, i)))
      if (maxval(abs(middle - view%centre)) > MARGIN * view%extent) cycle
      n = n + 1
      self%cells(:, n) = self%cells(:, i)
    end do
    self%cells = self%cells(:, :n)

    allocate (place(size(self%points, 2)), source=0)
    allocate (points(3, size(place)))
    n = 0
    do i = 1, size(self%cells, 2)
      do k = 1, size(self%cells, 1)
        associate (point => self%cells(k, i))
          if (place(point) == 0) then
            n = n + 1
            place(point) = n
            points(:, n) = self%points(:, point)
          end if
          point = place(point)
        end associate
      end do
    end do
    self%points = points(:, :n)

  end subroutine shape_picture_crop

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
