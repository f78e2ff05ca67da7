!> Rigid tools of facets: STL files and surface meshes, as they are or smoothed.
module swage_faceted
  use swage_bounding_tree, only: bounding_tree_create, bounding_tree_t, tree_search_t
  use swage_facet, only: bend_between, curve_distance, nearest_on_curve, nearest_on_triangle, &
                         PLACE_CORNER, PLACE_INSIDE, PLACE_SIDE, point_distance, surface_distance, &
                         side_tangents, triangle_point
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t, shape_picture_t, shape_view_t
  use swage_rotation, only: cross_product, dyadic, perpendicular
  use swage_status, only: status_t, STATUS_ERROR
  use swage_surface, only: surface_create, surface_t
  use swage_surface_file, only: surface_file_read
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: faceted_t, faceted_parameters_t, faceted_create, faceted_from_group

  integer, parameter :: NEXT(3) = [2, 3, 1], PREVIOUS(3) = [3, 1, 2]
  !> A point this far beyond the rim of an open surface, by the length of the facet there, is still
  !> above the facet: nodes in a symmetry plane in which the tool is cut.
  real(wp), parameter :: RIM = 1.0e-6_wp
  !> A vertex of an axisymmetric tool this near to the axis, by the size of the tool, is on it.
  real(wp), parameter :: ON_AXIS = 1.0e-9_wp

  type :: faceted_parameters_t
    !> True: facets become quadratic patches that meet with common normals.
    logical :: smoothing = .false.
    !> Facets at a larger angle meet at a sharp edge all the same [angle], radian.
    real(wp) :: feature_angle = 0.6_wp
    !> True: the surface may have a rim.
    logical :: open = .false.
    !> True: the material is inside a closed surface.
    logical :: inside = .false.
    !> True: turn facets that disagree with their neighbours.
    logical :: reorient = .false.
  end type faceted_parameters_t

  !> A surface of facets, with a tree over their boxes.
  type, extends(rigid_shape_t) :: faceted_t
    private
    !> 3: triangles; 2: lines of a plane problem.
    integer :: n_corner = 0
    integer :: n_facet = 0
    type(bounding_tree_t) :: tree
    !> Corners, and bends of the sides [length]; shape (3, 3, n_facet). Lines use the first bend.
    real(wp), allocatable :: corner(:, :, :)
    real(wp), allocatable :: bend(:, :, :)
    logical, allocatable :: flat(:)
    !> The facet with an area beyond each side, and which of its sides that is; 0 at a rim.
    integer, allocatable :: neighbour(:, :)
    integer, allocatable :: neighbour_side(:, :)
    !> Out of the tool at the corners: mean of the facets around by their angles; (3, 3, n_facet).
    real(wp), allocatable :: outside(:, :, :)
    !> True for a corner on a rim.
    logical, allocatable :: at_rim(:, :)
    !> Largest distance between a patch and its facet [length].
    real(wp) :: deviation = 0.0_wp
  contains
    procedure, public :: project => faceted_project
    procedure, public :: draw => faceted_draw
    !> Number of nodes of the tree that a projection looks at, to measure the search.
    procedure, public :: count_visits => faceted_count_visits
    !> Largest distance between the smoothed surface and its facets [length].
    procedure, public :: get_deviation => faceted_get_deviation
  end type faceted_t

contains

  !> Make a tool of facets.
  subroutine faceted_create(name, corners, label, parameters, dimension, faceted, status)
    !> What to call the surface in messages: the path of a file.
    character(len=*), intent(in) :: name
    !> Of each facet [length]; shape (3, n_corner, n_facet). Triangles are counterclockwise seen
    !> from outside; lines, in the plane z = 0, have the outside on their right.
    real(wp), intent(in) :: corners(:, :, :)
    !> Number of each facet in the file.
    integer, intent(in) :: label(:)
    type(faceted_parameters_t), intent(in) :: parameters
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    !> On failure it must not be used.
    type(faceted_t), intent(out) :: faceted
    !> `STATUS_ERROR` as [[surface_create]], and when the surface has a rim but must be closed.
    type(status_t), intent(inout) :: status

    integer :: facet
    real(wp), allocatable :: corner_normal(:, :, :)
    type(surface_t) :: surface

    call surface_create(name, corners, label, parameters%reorient, surface, status)
    if (status%failed()) return
    if (.not. surface%closed .and. .not. parameters%open) then
      facet = findloc(any(surface%neighbour == 0, dim=1), .true., dim=1)
      call status%raise(STATUS_ERROR, 'faceted_create', name//': the surface is not closed: '// &
                        'facet '//text(surface%label(facet))//' has a side without neighbour '// &
                        '(open = .true. accepts a surface with a rim)')
      return
    end if
    ! Inside and outside are sides of a closed surface, whichever way its facets point
    if (surface%closed .and. ((surface%volume < 0.0_wp) .neqv. parameters%inside)) then
      call turn_over(surface)
    end if

    faceted%name = 'faceted'
    faceted%anchor = 0.5_wp * (maxval(surface%x, dim=2) + minval(surface%x, dim=2))
    faceted%n_corner = surface%n_corner
    call find_corner_normals(surface, parameters, dimension == 'axisymmetric', corner_normal)
    call fill_facets(surface, corner_normal, parameters, faceted)
    call find_outside(surface, corner_normal, faceted)
    call plant_tree(faceted)
    faceted%note = text(faceted%n_facet)//' facets'
    if (.not. surface%closed) faceted%note = faceted%note//' with a rim'
    if (surface%n_dropped > 0) then
      faceted%note = faceted%note//', '//text(surface%n_dropped)//' without area left out'
    end if
    if (surface%n_turned > 0) faceted%note = faceted%note//', '//text(surface%n_turned)//' turned'
    if (parameters%smoothing) then
      faceted%note = faceted%note//', smoothed by at most '//text(faceted%deviation)//' [length]'
    end if

  end subroutine faceted_create

  !> Make a tool from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine faceted_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: file, physical_group, side
    integer :: n_corner
    integer, allocatable :: label(:)
    real(wp) :: scale
    real(wp), allocatable :: corners(:, :, :)
    type(faceted_parameters_t) :: p
    type(faceted_t), allocatable :: faceted
    type(status_t) :: status

    allocate (file, source='')
    allocate (physical_group, source='')
    allocate (side, source='outside')
    scale = 1.0_wp
    call group%take('file', file, 'STL file, text or binary, or mesh of Gmsh (.msh): its '// &
                    'triangles, in a plane problem its lines.', required=.true.)
    call group%take('group', physical_group, 'Physical group of the .msh that is the surface; '// &
                    'by default all triangles or lines.')
    call group%take('scale', scale, '1', 'Factor on the lengths of the file.', above=0.0_wp)
    call group%take('smoothing', p%smoothing, 'True: facets become quadratic patches with '// &
                    'common normals at their corners; false: facets as they are.')
    call group%take('feature_angle', p%feature_angle, 'angle', 'Facets that meet at a larger '// &
                    'angle, in radian, keep a sharp edge.', above=0.0_wp, upper=1.2_wp)
    call group%take('side', side, 'Where the material is: outside a closed surface, or inside '// &
                    'it as in a container.', choices=[character(len=7) :: 'outside', 'inside'])
    call group%take('open', p%open, 'True when the surface has a rim; its facets are then '// &
                    'counterclockwise seen from the material (lines: material on the right).')
    call group%take('reorient', p%reorient, 'True: turn facets that point to the other side '// &
                    'than their neighbours.')
    if (group%explaining .or. group%status%failed()) return
    if (group%given('feature_angle') .and. .not. p%smoothing) then
      call group%refuse('feature_angle', 'has no effect without smoothing = .true.')
    end if
    if (group%given('side') .and. p%open) then
      call group%refuse('side', 'has no effect on an open surface, whose facets tell the side')
    end if
    if (group%status%failed()) return

    p%inside = side == 'inside'
    n_corner = 2
    if (context%dimension == '3d') n_corner = 3
    call surface_file_read(context%resolve(file), n_corner, physical_group, context%comm, corners, &
                           label, status)
    if (.not. status%failed()) then
      corners = scale * corners
      allocate (faceted)
      call faceted_create(context%resolve(file), corners, label, p, context%dimension, faceted, &
                          status)
    end if
    if (status%failed()) then
      call group%refuse('file', trim(status%message))
      return
    end if
    call move_alloc(faceted, shape)

  end subroutine faceted_from_group

  !> Turn all facets over.
  subroutine turn_over(surface)
    type(surface_t), intent(inout) :: surface

    surface%normal = -surface%normal
    if (surface%n_corner == 3) then
      surface%vertex = surface%vertex([1, 3, 2], :)
      surface%neighbour = surface%neighbour([3, 2, 1], :)
      surface%neighbour_side = surface%neighbour_side([3, 2, 1], :)
      where (surface%neighbour > 0) surface%neighbour_side = 4 - surface%neighbour_side
    else
      surface%vertex = surface%vertex([2, 1], :)
      surface%neighbour = surface%neighbour([2, 1], :)
      surface%neighbour_side = surface%neighbour_side([2, 1], :)
      where (surface%neighbour > 0) surface%neighbour_side = 3 - surface%neighbour_side
    end if

  end subroutine turn_over

  !> The normal of each facet at each of its corners: its own, or smoothed over the facets around
  !> the corner as far as no sharp edge lies between.
  subroutine find_corner_normals(surface, parameters, axisymmetric, corner_normal)
    type(surface_t), intent(in) :: surface
    type(faceted_parameters_t), intent(in) :: parameters
    logical, intent(in) :: axisymmetric
    !> Unit vectors, 0 in a needle; shape (3, n_corner, n_facet).
    real(wp), allocatable, intent(out) :: corner_normal(:, :, :)

    integer :: facet, k
    real(wp) :: smallest_cosine

    smallest_cosine = cos(parameters%feature_angle)
    allocate (corner_normal(3, surface%n_corner, surface%n_facet))
    do facet = 1, surface%n_facet
      do k = 1, surface%n_corner
        corner_normal(:, k, facet) = surface%normal(:, facet)
        if (.not. parameters%smoothing .or. is_needle(surface, facet)) cycle
        if (surface%n_corner == 3) then
          corner_normal(:, k, facet) = normal_around(surface, facet, k, smallest_cosine)
        else
          corner_normal(:, k, facet) = normal_between(surface, facet, k, smallest_cosine, &
                                                      axisymmetric)
        end if
      end do
    end do

  end subroutine find_corner_normals

  pure function is_needle(surface, facet)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    logical :: is_needle

    is_needle = .not. any(abs(surface%normal(:, facet)) > 0.0_wp)

  end function is_needle

  !> Normal at a corner of a triangle, from all that can be reached around it without crossing a
  !> sharp edge: that of a paraboloid through the vertices around, where they are enough.
  pure function normal_around(surface, facet, corner, smallest_cosine) result(normal)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp), intent(in) :: smallest_cosine
    real(wp) :: normal(3)

    integer :: i, k
    integer, allocatable :: fan(:, :)
    real(wp), allocatable :: spokes(:, :)

    call collect_fan(surface, facet, corner, smallest_cosine, fan)
    allocate (spokes(3, 2 * size(fan, 2)))
    do i = 1, size(fan, 2)
      associate (x => surface%x(:, surface%vertex(:, fan(1, i))))
        k = fan(2, i)
        spokes(:, 2 * i - 1) = (x(:, NEXT(k)) - x(:, k)) / surface%size
        spokes(:, 2 * i) = (x(:, PREVIOUS(k)) - x(:, k)) / surface%size
      end associate
    end do
    normal = normal_of_fan(spokes)
    call fit_paraboloid(spokes, normal)

  end function normal_around

  !> The facets around a vertex up to the next sharp edges, without needles.
  pure subroutine collect_fan(surface, facet, corner, smallest_cosine, fan)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp), intent(in) :: smallest_cosine
    !> Facets, and which of their corners the vertex is; shape (2, :).
    integer, allocatable, intent(out) :: fan(:, :)

    integer :: here, last, n, side, step, way
    integer, allocatable :: longer(:, :)

    allocate (fan(2, 16))
    fan(:, 1) = [facet, corner]
    n = 1
    ways: do way = 1, 2
      here = facet
      last = facet
      side = corner
      if (way == 2) side = PREVIOUS(corner)
      do step = 1, surface%n_facet
        associate (beyond => surface%neighbour(side, here))
          if (beyond == 0) exit
          ! The way around has been once
          if (beyond == facet) exit ways
          side = surface%neighbour_side(side, here)
          here = beyond
        end associate
        if (.not. is_needle(surface, here)) then
          if (dot_product(surface%normal(:, last), surface%normal(:, here)) &
              < smallest_cosine) exit
          last = here
          if (n == size(fan, 2)) then
            allocate (longer(2, 2 * n))
            longer(:, :n) = fan
            call move_alloc(longer, fan)
          end if
          n = n + 1
          ! Going forwards the vertex is the end of the side just crossed, backwards its start
          fan(:, n) = [here, merge(NEXT(side), side, way == 1)]
        end if
        side = merge(NEXT(side), PREVIOUS(side), way == 1)
      end do
    end do ways
    fan = fan(:, :n)

  end subroutine collect_fan

  !> Mean of the normals of the facets around a vertex, with weights that are exact where the
  !> vertices lie on a sphere.
  !>
  !> Source: N. Max, J. Graphics Tools 4 (1999) 1–6.
  pure function normal_of_fan(spokes) result(normal)
    !> From the vertex to the other corners of each facet, counterclockwise; shape (3, 2 n_facet).
    real(wp), intent(in) :: spokes(:, :)
    real(wp) :: normal(3)

    integer :: i

    normal = 0.0_wp
    do i = 1, size(spokes, 2), 2
      normal = normal + cross_product(spokes(:, i), spokes(:, i + 1)) &
        / (sum(spokes(:, i)**2) * sum(spokes(:, i + 1)**2))
    end do
    normal = normal / norm2(normal)

  end function normal_of_fan

  !> Correct a normal by the paraboloid over its tangent plane that comes nearest to the vertices
  !> around: z = a x + b y + (c x² + 2 d x y + e y²)/2. Left as it is where they are too few.
  pure subroutine fit_paraboloid(spokes, normal)
    !> As `normal_of_fan`.
    real(wp), intent(in) :: spokes(:, :)
    real(wp), intent(inout) :: normal(3)

    !> A pivot below this share of its diagonal: the vertices do not tell all coefficients.
    real(wp), parameter :: SMALLEST_PIVOT = 1.0e-2_wp
    !> Largest slope of the correction, a fifth of the angle of sharp edges.
    real(wp), parameter :: LARGEST_SLOPE = 0.2_wp

    integer :: i, j, k
    real(wp) :: first(3), matrix(5, 5), pivot, right(5), row(5), scale, second(3), square, x, y

    first = perpendicular(normal)
    second = cross_product(normal, first)
    scale = sqrt(sum(spokes**2) / size(spokes, 2))
    matrix = 0.0_wp
    right = 0.0_wp
    do i = 1, size(spokes, 2)
      x = dot_product(spokes(:, i), first) / scale
      y = dot_product(spokes(:, i), second) / scale
      square = x**2 + y**2
      if (.not. square > 0.0_wp) return
      row = [x, y, 0.5_wp * x**2, x * y, 0.5_wp * y**2]
      ! Near vertices tell more: heights by the square of the distance
      do j = 1, 5
        matrix(:, j) = matrix(:, j) + row * row(j) / square**2
      end do
      right = right + row * dot_product(spokes(:, i), normal) / (scale * square**2)
    end do

    do k = 1, 5
      pivot = matrix(k, k)
      if (.not. pivot > SMALLEST_PIVOT) return
      do i = k + 1, 5
        right(i) = right(i) - matrix(i, k) / pivot * right(k)
        matrix(i, k + 1:) = matrix(i, k + 1:) - matrix(i, k) / pivot * matrix(k, k + 1:)
      end do
    end do
    do k = 5, 1, -1
      right(k) = (right(k) - dot_product(matrix(k, k + 1:), right(k + 1:))) / matrix(k, k)
    end do
    if (norm2(right(1:2)) > LARGEST_SLOPE) return
    normal = normal - right(1) * first - right(2) * second
    normal = normal / norm2(normal)

  end subroutine fit_paraboloid

  !> Normal at an end of a line, from both lines there; exact on a circle. A line that ends on the
  !> axis of revolution goes on as its mirror image.
  pure function normal_between(surface, facet, corner, smallest_cosine, axisymmetric) &
    result(normal)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp), intent(in) :: smallest_cosine
    logical, intent(in) :: axisymmetric
    real(wp) :: normal(3)

    integer :: other
    real(wp) :: mirrored(3)

    normal = surface%normal(:, facet)
    other = surface%neighbour(corner, facet)
    if (other > 0) then
      if (dot_product(normal, surface%normal(:, other)) >= smallest_cosine) then
        normal = normal / length(facet) + surface%normal(:, other) / length(other)
      end if
    else if (axisymmetric) then
      mirrored = [-normal(1), normal(2), 0.0_wp]
      if (surface%x(1, surface%vertex(corner, facet)) <= ON_AXIS * surface%size .and. &
          dot_product(normal, mirrored) >= smallest_cosine) normal = normal + mirrored
    end if
    normal = normal / norm2(normal)

  contains

    pure function length(facet)
      integer, intent(in) :: facet
      real(wp) :: length

      length = norm2(surface%x(:, surface%vertex(2, facet)) &
                     - surface%x(:, surface%vertex(1, facet)))

    end function length

  end function normal_between

  !> Corners, bends and neighbours of the facets with an area.
  subroutine fill_facets(surface, corner_normal, parameters, faceted)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: corner_normal(:, :, :)
    type(faceted_parameters_t), intent(in) :: parameters
    type(faceted_t), intent(inout) :: faceted

    integer :: beyond, beyond_side, facet, i, k
    integer, allocatable :: place(:)
    real(wp) :: middle(3)

    allocate (place(surface%n_facet), source=0)
    do facet = 1, surface%n_facet
      if (is_needle(surface, facet)) cycle
      faceted%n_facet = faceted%n_facet + 1
      place(facet) = faceted%n_facet
    end do
    associate (n => faceted%n_facet)
      allocate (faceted%corner(3, 3, n), faceted%bend(3, 3, n), faceted%outside(3, 3, n), &
                source=0.0_wp)
      allocate (faceted%neighbour(3, n), faceted%neighbour_side(3, n), source=0)
      allocate (faceted%flat(n), source=.true.)
      allocate (faceted%at_rim(3, n), source=.false.)
    end associate
    do facet = 1, surface%n_facet
      i = place(facet)
      if (i == 0) cycle
      faceted%corner(:, :surface%n_corner, i) = surface%x(:, surface%vertex(:, facet))
      do k = 1, surface%n_corner
        call look_beyond(surface, facet, k, beyond, beyond_side)
        if (beyond == 0) cycle
        faceted%neighbour(k, i) = place(beyond)
        faceted%neighbour_side(k, i) = beyond_side
      end do
      if (.not. parameters%smoothing) cycle

      do k = 1, merge(3, 1, surface%n_corner == 3)
        faceted%bend(:, k, i) = bend_of(surface, corner_normal, facet, k)
        faceted%deviation = max(faceted%deviation, 0.25_wp * norm2(faceted%bend(:, k, i)))
      end do
      if (surface%n_corner == 3) then
        middle = sum(faceted%bend(:, :, i), dim=2) / 9.0_wp
        faceted%deviation = max(faceted%deviation, norm2(middle))
      end if
      faceted%flat(i) = .not. any(abs(faceted%bend(:, :, i)) > 0.0_wp)
    end do

  end subroutine fill_facets

  !> The facet with an area beyond a side: across needles, from one of their long sides to the
  !> other.
  subroutine look_beyond(surface, facet, side, beyond, beyond_side)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: side
    !> 0 when there is none.
    integer, intent(out) :: beyond
    integer, intent(out) :: beyond_side

    integer :: k, longest, step
    real(wp) :: lengths(3)

    beyond = surface%neighbour(side, facet)
    beyond_side = surface%neighbour_side(side, facet)
    do step = 1, surface%n_facet
      if (beyond == 0) return
      if (.not. is_needle(surface, beyond)) return
      associate (x => surface%x(:, surface%vertex(:, beyond)))
        do k = 1, 3
          lengths(k) = norm2(x(:, NEXT(k)) - x(:, k))
        end do
      end associate
      lengths(beyond_side) = -1.0_wp
      longest = maxloc(lengths, dim=1)
      beyond_side = surface%neighbour_side(longest, beyond)
      beyond = surface%neighbour(longest, beyond)
    end do

  end subroutine look_beyond

  !> Bend of a side. Both facets of a side get the same, up to rounding: the surface has no gap.
  function bend_of(surface, corner_normal, facet, side) result(bend)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: corner_normal(:, :, :)
    integer, intent(in) :: facet
    !> Of a triangle; 1 for a line.
    integer, intent(in) :: side
    real(wp) :: bend(3)

    !> Normals nearer to each other than this are one.
    real(wp), parameter :: SAME = 1.0e-10_wp

    integer :: beyond, first, last, other_side
    real(wp) :: along(3)

    first = side
    last = 2
    if (surface%n_corner == 3) last = NEXT(side)
    along = surface%x(:, surface%vertex(last, facet)) - surface%x(:, surface%vertex(first, facet))
    beyond = 0
    if (surface%n_corner == 3) then
      beyond = surface%neighbour(side, facet)
      other_side = surface%neighbour_side(side, facet)
    end if
    if (beyond > 0) then
      if (is_needle(surface, beyond)) beyond = 0
    end if
    if (beyond > 0) then
      ! The neighbour passes the side the other way
      associate (mine => corner_normal(:, [first, last], facet), &
                 other => corner_normal(:, [NEXT(other_side), other_side], beyond))
        if (maxval(abs(mine - other)) > SAME) then
          bend = bend_between(along, &
                              reshape([mine(:, 1), other(:, 1)], [3, 2]), &
                              reshape([mine(:, 2), other(:, 2)], [3, 2]))
          return
        end if
      end associate
    end if
    bend = bend_between(along, corner_normal(:, first:first, facet), &
                        corner_normal(:, last:last, facet))

  end function bend_of

  !> Which way is out at the corners: there the sign of the distance cannot be read from one facet.
  !>
  !> Source: J. A. Bærentzen, H. Aanæs, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243–253.
  subroutine find_outside(surface, corner_normal, faceted)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: corner_normal(:, :, :)
    type(faceted_t), intent(inout) :: faceted

    integer :: facet, i, k
    logical, allocatable :: at_rim(:)
    real(wp) :: angle, backward(3), forward(3)
    real(wp), allocatable :: outside(:, :)

    allocate (outside(3, surface%n_vertex), source=0.0_wp)
    allocate (at_rim(surface%n_vertex), source=.false.)
    do facet = 1, surface%n_facet
      associate (vertex => surface%vertex(:, facet))
        do k = 1, surface%n_corner
          if (surface%neighbour(k, facet) == 0) then
            at_rim(vertex(k)) = .true.
            if (surface%n_corner == 3) at_rim(vertex(NEXT(k))) = .true.
          end if
          angle = 1.0_wp
          if (surface%n_corner == 3) then
            forward = surface%x(:, vertex(NEXT(k))) - surface%x(:, vertex(k))
            backward = surface%x(:, vertex(PREVIOUS(k))) - surface%x(:, vertex(k))
            angle = atan2(norm2(cross_product(forward, backward)), dot_product(forward, backward))
          end if
          outside(:, vertex(k)) = outside(:, vertex(k)) + angle * corner_normal(:, k, facet)
        end do
      end associate
    end do
    i = 0
    do facet = 1, surface%n_facet
      if (is_needle(surface, facet)) cycle
      i = i + 1
      do k = 1, surface%n_corner
        faceted%outside(:, k, i) = outside(:, surface%vertex(k, facet))
        faceted%at_rim(k, i) = at_rim(surface%vertex(k, facet))
      end do
    end do

  end subroutine find_outside

  !> The boxes hold the control points of the patches, and so the patches.
  subroutine plant_tree(faceted)
    type(faceted_t), intent(inout) :: faceted

    integer :: i, k, next_corner
    real(wp) :: control(3)
    real(wp), allocatable :: lower(:, :), upper(:, :)

    allocate (lower(3, faceted%n_facet), upper(3, faceted%n_facet))
    do i = 1, faceted%n_facet
      associate (corner => faceted%corner(:, :faceted%n_corner, i))
        lower(:, i) = minval(corner, dim=2)
        upper(:, i) = maxval(corner, dim=2)
        do k = 1, merge(3, 1, faceted%n_corner == 3)
          next_corner = 1 + mod(k, faceted%n_corner)
          control = 0.5_wp * (corner(:, k) + corner(:, next_corner) - faceted%bend(:, k, i))
          lower(:, i) = min(lower(:, i), control)
          upper(:, i) = max(upper(:, i), control)
        end do
      end associate
    end do
    call bounding_tree_create(lower, upper, faceted%tree)

  end subroutine plant_tree

  !> See [[rigid_shape_t:project]].
  pure subroutine faceted_project(self, x, penetration, normal, hessian)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: penetration
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    integer :: facet, n_visited, place
    real(wp) :: distance, weight(3)

    call find_nearest(self, x, facet, weight, place, n_visited)
    if (self%n_corner == 2) then
      call answer_on_line(self, x, facet, weight, place, distance, normal, hessian)
    else if (place == PLACE_INSIDE) then
      call surface_distance(self%corner(:, :, facet), self%bend(:, :, facet), weight, x, &
                            distance, normal, hessian)
    else if (place <= PLACE_CORNER) then
      call answer_on_side(self, x, facet, place - PLACE_SIDE, weight, distance, normal, hessian)
    else
      call answer_at_corner(self, x, facet, place - PLACE_CORNER, distance, normal, hessian)
    end if
    penetration = -distance
    hessian = -hessian

  end subroutine faceted_project

  !> The facet with the point nearest to x.
  pure subroutine find_nearest(self, x, facet, weight, place, n_visited)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    integer, intent(out) :: facet
    !> Of the corners of the facet at that point, and where on the facet it is.
    real(wp), intent(out) :: weight(3)
    integer, intent(out) :: place
    integer, intent(out) :: n_visited

    integer :: candidate, candidate_place
    real(wp) :: candidate_weight(3), from(3), s, square
    type(tree_search_t) :: search

    facet = 0
    weight = 0.0_wp
    place = PLACE_INSIDE
    call self%tree%start(x, huge(1.0_wp), search)
    do
      call self%tree%next(search, candidate)
      if (candidate == 0) exit
      associate (corner => self%corner(:, :, candidate), bend => self%bend(:, :, candidate))
        if (self%n_corner == 3) then
          call nearest_on_triangle(corner, bend, self%flat(candidate), x, candidate_weight, &
                                   candidate_place)
          from = x - triangle_point(corner, bend, candidate_weight)
        else
          call nearest_on_curve(corner(:, 1), corner(:, 2), bend(:, 1), x, s)
          candidate_weight = [1.0_wp - s, s, 0.0_wp]
          candidate_place = PLACE_INSIDE
          if (s <= 0.0_wp) candidate_place = PLACE_CORNER + 1
          if (s >= 1.0_wp) candidate_place = PLACE_CORNER + 2
          from = x - triangle_point(corner, bend, candidate_weight)
        end if
      end associate
      square = dot_product(from, from)
      if (square >= search%bound) cycle
      search%bound = square
      facet = candidate
      weight = candidate_weight
      place = candidate_place
    end do
    n_visited = search%n_visited

  end subroutine find_nearest

  !> Distance where the nearest point is inside a side of a triangle.
  pure subroutine answer_on_side(self, x, facet, side, weight, distance, normal, hessian)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: facet
    integer, intent(in) :: side
    real(wp), intent(in) :: weight(3)
    !> Positive outside [length].
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    integer :: other, other_side
    real(wp) :: along(3), from(3), gradient(3), ignored(3, 3), mine(3), other_weight(3), others(3)

    associate (corner => self%corner(:, :, facet), bend => self%bend(:, :, facet))
      call surface_distance(corner, bend, weight, x, distance, mine, hessian)
      other = self%neighbour(side, facet)
      if (other == 0) then
        ! Beyond a rim is outside, but for rounding
        along = corner(:, NEXT(side)) - corner(:, side)
        from = x - triangle_point(corner, bend, weight)
        normal = mine
        if (dot_product(from, cross_product(along, mine)) <= RIM * dot_product(along, along)) return
        others = mine
      else
        other_side = self%neighbour_side(side, facet)
        other_weight = 0.0_wp
        other_weight(other_side) = weight(NEXT(side))
        other_weight(NEXT(other_side)) = weight(side)
        call surface_distance(self%corner(:, :, other), self%bend(:, :, other), other_weight, x, &
                              distance, others, ignored)
      end if
      call curve_distance(corner(:, side), corner(:, NEXT(side)), bend(:, side), &
                          weight(NEXT(side)), x, distance, gradient, hessian)
    end associate
    if (other == 0) then
      normal = gradient
    else
      call give_sign(mine + others, gradient, distance, normal, hessian)
    end if

  end subroutine answer_on_side

  !> Distance where the nearest point is a corner of a triangle.
  pure subroutine answer_at_corner(self, x, facet, corner, distance, normal, hessian)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: across(3), from(3), gradient(3), out(3), scale

    from = x - self%corner(:, corner, facet)
    out = self%outside(:, corner, facet)
    scale = norm2(self%corner(:, 2, facet) - self%corner(:, 1, facet))
    call point_distance(from, scale, distance, gradient, hessian)
    if (self%at_rim(corner, facet)) then
      normal = out / norm2(out)
      across = from - dot_product(from, normal) * normal
      if (norm2(across) <= RIM * scale) then
        distance = dot_product(from, normal)
        hessian = 0.0_wp
      else
        normal = gradient
      end if
      return
    end if
    call give_sign(out, gradient, distance, normal, hessian)

  end subroutine answer_at_corner

  !> The sign of a distance from a line or point of the surface.
  pure subroutine give_sign(out, gradient, distance, normal, hessian)
    !> A vector to the outside.
    real(wp), intent(in) :: out(3)
    !> Of the distance; 0 on the line or point itself.
    real(wp), intent(in) :: gradient(3)
    real(wp), intent(inout) :: distance
    real(wp), intent(out) :: normal(3)
    real(wp), intent(inout) :: hessian(3, 3)

    if (dot_product(gradient, gradient) < 0.5_wp) then
      normal = out / norm2(out)
    else if (dot_product(gradient, out) < 0.0_wp) then
      distance = -distance
      normal = -gradient
      hessian = -hessian
    else
      normal = gradient
    end if

  end subroutine give_sign

  !> Distance in a plane problem.
  pure subroutine answer_on_line(self, x, facet, weight, place, distance, normal, hessian)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: facet
    real(wp), intent(in) :: weight(3)
    integer, intent(in) :: place
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    integer :: end
    real(wp) :: bending, from(3), gradient(3), slope, tangent(3)

    associate (corner => self%corner(:, :, facet), bend => self%bend(:, 1, facet))
      tangent = corner(:, 2) - corner(:, 1) - (weight(1) - weight(2)) * bend
      slope = dot_product(tangent, tangent)
      normal = [tangent(2), -tangent(1), 0.0_wp] / sqrt(slope)
      from = x - triangle_point(corner, self%bend(:, :, facet), weight)
      if (place > PLACE_CORNER) then
        end = place - PLACE_CORNER
        if (.not. self%at_rim(end, facet)) then
          call point_distance(from, sqrt(slope), distance, gradient, hessian)
          hessian(3, :) = 0.0_wp
          hessian(:, 3) = 0.0_wp
          call give_sign(self%outside(:, end, facet), gradient, distance, normal, hessian)
          return
        end if
        if (abs(dot_product(from, tangent)) > RIM * slope) then
          call point_distance(from, sqrt(slope), distance, normal, hessian)
          hessian(3, :) = 0.0_wp
          hessian(:, 3) = 0.0_wp
          return
        end if
      end if
      distance = dot_product(from, normal)
      bending = 2.0_wp * dot_product(normal, bend)
      hessian = 0.0_wp
      if (slope - distance * bending > epsilon(1.0_wp) * slope) then
        hessian = -bending / (slope * (slope - distance * bending)) * dyadic(tangent, tangent)
      end if
    end associate

  end subroutine answer_on_line

  pure function faceted_count_visits(self, x) result(n_visited)
    class(faceted_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    integer :: n_visited

    integer :: facet, place
    real(wp) :: weight(3)

    call find_nearest(self, x, facet, weight, place, n_visited)

  end function faceted_count_visits

  pure function faceted_get_deviation(self) result(deviation)
    class(faceted_t), intent(in) :: self
    real(wp) :: deviation

    deviation = self%deviation

  end function faceted_get_deviation

  !> See [[rigid_shape_t:draw]]: the facets, patches in several pieces.
  subroutine faceted_draw(self, view, picture)
    class(faceted_t), intent(in) :: self
    type(shape_view_t), intent(in) :: view
    type(shape_picture_t), intent(out) :: picture

    !> Pieces of a side of a patch, fewer where there are many patches.
    integer, parameter :: MOST_PIECES = 4, MANY = 5000

    integer :: base, facet, i, j, n_cell, n_piece, n_point, row(0:MOST_PIECES + 1)

    n_piece = MOST_PIECES
    if (all(self%flat) .or. self%n_facet > MANY) n_piece = 1
    ! Rows of a triangle: row i has i points
    do i = 0, MOST_PIECES + 1
      row(i) = i * (i - 1) / 2
    end do
    n_point = n_piece + 1
    n_cell = n_piece
    if (self%n_corner == 3) then
      n_point = row(n_piece + 1) + n_piece + 1
      n_cell = n_piece**2
    end if
    allocate (picture%points(3, n_point * self%n_facet), &
              picture%cells(self%n_corner, n_cell * self%n_facet))
    n_point = 0
    n_cell = 0
    do facet = 1, self%n_facet
      base = n_point
      do i = 0, n_piece
        do j = 0, merge(i, 0, self%n_corner == 3)
          n_point = n_point + 1
          picture%points(:, n_point) = triangle_point(self%corner(:, :, facet), &
                                                      self%bend(:, :, facet), weights(i, j))
          if (i == n_piece) cycle
          n_cell = n_cell + 1
          if (self%n_corner == 2) then
            picture%cells(:, n_cell) = [n_point, n_point + 1]
            cycle
          end if
          picture%cells(:, n_cell) = [n_point, base + row(i + 2) + j + 1, base + row(i + 2) + j + 2]
          if (j == i) cycle
          n_cell = n_cell + 1
          picture%cells(:, n_cell) = [n_point, base + row(i + 2) + j + 2, n_point + 1]
        end do
      end do
    end do
    call picture%crop(view)

  contains

    pure function weights(i, j) result(weight)
      integer, intent(in) :: i, j
      real(wp) :: weight(3)

      weight = [real(n_piece - i, wp), real(i - j, wp), real(j, wp)] / n_piece

    end function weights

  end subroutine faceted_draw

end module swage_faceted
