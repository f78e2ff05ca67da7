!> A deformable surface that takes part in contact: its facets, their normals, areas and boxes.
!>
!> Facets are flat: lines in the plane, triangles in space, outward oriented. At each node the
!> facets around it fall into sectors, within which the surface is smooth: neighbours belong
!> together when their normals differ by less than the feature angle. Each sector has a normal, the
!> mean of those of its facets, in space weighted by their angles at the node. Sectors, areas and
!> bulges are those of the start of the step, everything else is of the present iterate.
!>
!> Smoothed, a facet is a curved patch that meets the normals of its sectors: with the weights w of
!> its corners it rises over its plane by \(\sum_k b_k w_k w_{k+1}\), b the bulges of its sides,
!> half the tangents of the normals against the facet's at both ends of a side, times its length
!> (the quadratic patch of [[swage_facet]], its part across the facet). Where a sector does not go
!> on beyond an end of a side, at a rim or a sharp edge, the tangent of the other end counts for
!> both: normals there know one side only.
!>
!> A surface may be that of a whole body: facets that turn away from the other surface do not count
!> in the areas pressed on, so that a node at an edge has the area of the side that is in contact.
!> Nor do facets that gape count at nodes with others that touch: a side that folds onto a tool must
!> not lift its edge off.
!>
!> A vertex is a node on a sharp convex edge, or at a corner. It may touch before its facets do, and
!> then alone: like one more facet, without a size, it competes with those around it. As far as all
!> of them gape where it does not, the condition is that of the vertex, and its normal the other
!> surface's, for it has none of its own; as far as one of them does not, that of the facets.
module swage_contact_surface
  use swage_bounding_tree, only: bounding_tree_create, bounding_tree_t
  use swage_kinds, only: wp
  use swage_rotation, only: cross_product, normalised
  implicit none(type, external)
  private

  public :: contact_surface_t, contact_surface_create
  public :: DEFAULT_FEATURE_ANGLE

  !> Angle between the normals of neighbours from which on an edge is sharp [angle], radian.
  real(wp), parameter :: DEFAULT_FEATURE_ANGLE = 0.7_wp

  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)
  !> How much more a facet gapes than another one, and than a vertex, by its size, from which on it
  !> does not count beside it.
  real(wp), parameter :: APART = 0.1_wp, BESIDE_VERTEX = 0.05_wp
  !> Share of a facet that does not count.
  real(wp), parameter :: LEAST_SHARE = 1.0e-6_wp
  !> Next corner of a triangle.
  integer, parameter :: NEXT(3) = [2, 3, 1]

  !> Node numbers are places in a list of surface nodes that is common to all surfaces.
  type :: contact_surface_t
    !> Dimensions of the problem, and corners of a facet.
    integer :: n_dim = 0
    integer :: n_facet = 0
    logical :: axisymmetric = .false.
    real(wp) :: feature_angle = DEFAULT_FEATURE_ANGLE
    !> Corners; shape (n_dim, n_facet). In the plane the body lies to the left of the way from the
    !> first to the second; in space the order is counter-clockwise seen from outside.
    integer, allocatable :: facet(:, :)
    !> Nodes of the surface, ascending.
    integer, allocatable :: node(:)
    !> Facets around node k: `around(first(k):first(k + 1) - 1)`, ascending, and which of their
    !> corners it is.
    integer, allocatable :: first(:), around(:), around_corner(:)
    !> Facet beyond each side, 0 at a rim; shape (n_dim, n_facet). In the plane that beyond a
    !> corner, in space that beyond the side from a corner to the next.
    integer, allocatable :: neighbour(:, :)
    !> Sector of each corner; shape (n_dim, n_facet).
    integer, allocatable :: sector(:, :)
    integer :: n_sector = 0
    !> Whether each node lies on a sharp convex edge; shape (n_node).
    logical, allocatable :: is_vertex(:)
    !> At the start of the step: length or area of the facets [length], [length^2], distance of
    !> their corners from the axis [length], shapes (n_facet), (n_dim, n_facet); area of the nodes
    !> [length^2], in the plane for a unit thickness; shape (n_node).
    real(wp), allocatable :: extent(:), radius(:, :), area(:)
    !> Bulges of the sides, in the plane the first alone [length]; shape (3, n_facet).
    real(wp), allocatable :: bulge(:, :)
    !> How much of each facet counts, least share of any facet for a node, and the area of the nodes
    !> that counts [1], [1], [length^2]; shapes (n_facet), (n_node), (n_node).
    real(wp), allocatable :: share(:), least_share(:), pressed_area(:)
    !> Gap of each facet to the other surface, 0 where it touches or is inside, and the smallest of
    !> the facets around each node [length]; shapes (n_facet), (n_node).
    real(wp), allocatable :: gap(:), least_gap(:)
    !> Gap of each vertex, that of no matter how far at other nodes [length], and how much of a
    !> condition is that of the vertex alone [1]; shapes (n_node).
    real(wp), allocatable :: vertex_gap(:), vertex_share(:)
    !> Positions of the nodes, only those of this surface are looked at [length]; shape (3, n_node).
    real(wp), allocatable :: x(:, :)
    !> Unit normals of the facets and of the sectors; shapes (3, n_facet), (3, n_sector).
    real(wp), allocatable :: normal(:, :), sector_normal(:, :)
    !> Those of the facets at the start of the step; shape of `normal`.
    real(wp), allocatable :: normal_old(:, :)
    type(bounding_tree_t) :: tree
  contains
    !> Take new positions as those of the start of a step.
    procedure :: begin_step => contact_surface_begin_step
    !> Take new positions.
    procedure :: update => contact_surface_update
    !> Positions of the corners of a facet.
    procedure :: corners => contact_surface_corners
    !> The point of a facet with given weights of its corners.
    procedure :: point => contact_surface_point
    !> Area of a whole facet by the density at a point, with the turn in an axisymmetric problem.
    procedure :: measure => contact_surface_measure
    !> Integrals of the products of two shape functions over a facet.
    procedure :: mass => contact_surface_mass
    !> Say how much of each facet counts.
    procedure :: take_shares => contact_surface_take_shares
    !> How much a facet counts for one of its corners, by how near it is.
    procedure :: near_share => contact_surface_near_share
    !> The same beside the node itself, where that is a vertex.
    procedure :: face_share => contact_surface_face_share
    !> How much a facet counts for one of its corners, by how near it is and how much it faces the
    !> other surface.
    procedure :: pressed_share => contact_surface_pressed_share
    !> A column of the mass matrix of a facet as far as it counts.
    procedure :: pressed_mass => contact_surface_pressed_mass
    !> Gradients of the weights of the corners along a facet.
    procedure :: gradients => contact_surface_gradients
    !> Height of the smoothed facet over its plane, at given weights.
    procedure :: rise => contact_surface_rise
    !> Its derivatives by the weights.
    procedure :: rise_by_weight => contact_surface_rise_by_weight
    !> True when the facets of a node look towards a surface with the given normal.
    procedure :: faces => contact_surface_faces
    !> True when a facet has a corner on the facets around some nodes.
    procedure :: is_near => contact_surface_is_near
    !> Normals of the sectors around a node.
    procedure :: normals_at => contact_surface_normals_at
  end type contact_surface_t

contains

  !> Make a surface without positions; call `begin_step` next.
  pure subroutine contact_surface_create(n_dim, axisymmetric, facet, n_node, feature_angle, surface)
    integer, intent(in) :: n_dim
    logical, intent(in) :: axisymmetric
    !> Shape (n_dim, n_facet).
    integer, intent(in) :: facet(:, :)
    !> Surface nodes, of all surfaces.
    integer, intent(in) :: n_node
    !> [radian]
    real(wp), intent(in) :: feature_angle
    type(contact_surface_t), intent(out) :: surface

    integer :: a, f, k, n
    integer, allocatable :: place(:)

    surface%n_dim = n_dim
    surface%n_facet = size(facet, 2)
    surface%axisymmetric = axisymmetric
    surface%feature_angle = feature_angle
    allocate (surface%facet, source=facet)

    allocate (surface%first(n_node + 1), source=0)
    do f = 1, surface%n_facet
      do a = 1, n_dim
        surface%first(facet(a, f) + 1) = surface%first(facet(a, f) + 1) + 1
      end do
    end do
    allocate (surface%node(count(surface%first > 0)))
    n = 0
    surface%first(1) = 1
    do k = 1, n_node
      if (surface%first(k + 1) > 0) then
        n = n + 1
        surface%node(n) = k
      end if
      surface%first(k + 1) = surface%first(k) + surface%first(k + 1)
    end do
    allocate (surface%around(n_dim * surface%n_facet))
    allocate (surface%around_corner(n_dim * surface%n_facet))
    allocate (place, source=surface%first)
    do f = 1, surface%n_facet
      do a = 1, n_dim
        k = facet(a, f)
        surface%around(place(k)) = f
        surface%around_corner(place(k)) = a
        place(k) = place(k) + 1
      end do
    end do
    call find_neighbours(surface)

    allocate (surface%extent(surface%n_facet), surface%radius(n_dim, surface%n_facet), &
              surface%area(n_node), surface%pressed_area(n_node), surface%x(3, n_node), &
              surface%normal(3, surface%n_facet), surface%normal_old(3, surface%n_facet), &
              surface%bulge(3, surface%n_facet), &
              source=0.0_wp)
    allocate (surface%share(surface%n_facet), surface%least_share(n_node), &
              source=1.0_wp)
    allocate (surface%gap(surface%n_facet), surface%least_gap(n_node), &
              surface%vertex_share(n_node), source=0.0_wp)
    allocate (surface%vertex_gap(n_node), source=huge(1.0_wp))
    allocate (surface%is_vertex(n_node), source=.false.)
    allocate (surface%sector(n_dim, surface%n_facet), source=0)
    allocate (surface%sector_normal(3, 0))

  end subroutine contact_surface_create

  !> Where more than two facets meet, there is a rim.
  pure subroutine find_neighbours(surface)
    type(contact_surface_t), intent(inout) :: surface

    integer :: a, f, found, i, n_found, node

    allocate (surface%neighbour(surface%n_dim, surface%n_facet), source=0)
    do f = 1, surface%n_facet
      do a = 1, surface%n_dim
        node = surface%facet(a, f)
        found = 0
        n_found = 0
        do i = surface%first(node), surface%first(node + 1) - 1
          if (surface%around(i) == f) cycle
          if (surface%n_dim == 3) then
            if (all(surface%facet(:, surface%around(i)) /= surface%facet(NEXT(a), f))) cycle
          end if
          found = surface%around(i)
          n_found = n_found + 1
        end do
        if (n_found == 1) surface%neighbour(a, f) = found
      end do
    end do

  end subroutine find_neighbours

  pure subroutine contact_surface_begin_step(self, x)
    class(contact_surface_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    integer :: a, f
    real(wp) :: mass(3, 3)
    real(wp), allocatable :: lower(:, :), upper(:, :)

    self%x = x
    call find_facet_normals(self)
    self%normal_old = self%normal
    call find_sectors(self)
    self%area = 0.0_wp
    do f = 1, self%n_facet
      associate (node => self%facet(:, f))
        if (self%n_dim == 2) then
          self%extent(f) = norm2(x(:, node(2)) - x(:, node(1)))
        else
          self%extent(f) = 0.5_wp * norm2(cross_product(x(:, node(2)) - x(:, node(1)), &
                                                        x(:, node(3)) - x(:, node(1))))
        end if
        self%radius(:, f) = x(1, node)
        mass = self%mass(f)
        do a = 1, self%n_dim
          self%area(node(a)) = self%area(node(a)) + sum(mass(:, a))
        end do
      end associate
    end do
    self%share = 1.0_wp
    self%least_share = 1.0_wp
    self%gap = 0.0_wp
    self%least_gap = 0.0_wp
    self%vertex_gap = huge(1.0_wp)
    self%vertex_share = 0.0_wp
    self%pressed_area = self%area
    call find_boxes(self, lower, upper)
    call bounding_tree_create(lower, upper, self%tree)
    call self%update(x)
    call find_bulges(self)

  end subroutine contact_surface_begin_step

  !> How far the patches that meet the normals of the sectors rise over their facets.
  pure subroutine find_bulges(surface)
    type(contact_surface_t), intent(inout) :: surface

    integer :: f, k, last
    logical :: goes_on(2)
    real(wp) :: side(3), tangent(2)

    surface%bulge = 0.0_wp
    do f = 1, surface%n_facet
      do k = 1, merge(1, 3, surface%n_dim == 2)
        last = NEXT(k)
        associate (node => surface%facet(:, f), up => surface%normal(:, f), &
                   normal_first => surface%sector_normal(:, surface%sector(k, f)), &
                   normal_last => surface%sector_normal(:, surface%sector(last, f)))
          side = surface%x(:, node(last)) - surface%x(:, node(k))
          tangent(1) = -dot_product(normal_first, side) / dot_product(normal_first, up)
          tangent(2) = dot_product(normal_last, side) / dot_product(normal_last, up)
        end associate
        goes_on(1) = continues(surface, f, k, -side)
        goes_on(2) = continues(surface, f, last, side)
        if (.not. any(goes_on)) goes_on(maxloc(abs(tangent))) = .true.
        surface%bulge(k, f) = sum(tangent, mask=goes_on) / count(goes_on)
      end do
    end do

  end subroutine find_bulges

  !> True when the sector of a corner has a facet in the given direction from its node.
  pure function continues(surface, facet, corner, direction)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp), intent(in) :: direction(3)
    logical :: continues

    !> Sine of the angle that the direction may be beside the facet.
    real(wp), parameter :: BESIDE = 0.1_wp

    integer :: i
    real(wp) :: backward(3), forward(3)

    continues = .false.
    associate (node => surface%facet(corner, facet), x => surface%x)
      do i = surface%first(node), surface%first(node + 1) - 1
        associate (f => surface%around(i), a => surface%around_corner(i))
          if (f == facet .or. surface%sector(a, f) /= surface%sector(corner, facet)) cycle
          if (surface%n_dim == 2) then
            continues = .true.
            cycle
          end if
          forward = x(:, surface%facet(NEXT(a), f)) - x(:, node)
          backward = x(:, surface%facet(NEXT(NEXT(a)), f)) - x(:, node)
          associate (normal => surface%normal(:, f), least => -BESIDE * norm2(direction))
            continues = continues .or. &
              (dot_product(cross_product(forward, direction), normal) >= least * norm2(forward) &
               .and. dot_product(cross_product(direction, backward), normal) &
               >= least * norm2(backward))
          end associate
        end associate
      end do
    end associate

  end function continues

  !> A node of which little counts keeps a tenth of its area, one of which nothing does keeps all:
  !> it must not be free to penetrate when it comes into contact during the step.
  pure subroutine contact_surface_take_shares(self, share, gap, vertex_gap)
    class(contact_surface_t), intent(inout) :: self
    !> From 0 to 1; shape (n_facet).
    real(wp), intent(in) :: share(:)
    !> Of the facets' middles to the other surface, negative inside [length]; shape (n_facet).
    real(wp), intent(in) :: gap(:)
    !> The same of the vertices; what stands at other nodes does not count; shape (n_node).
    real(wp), intent(in) :: vertex_gap(:)

    real(wp), parameter :: LEAST = 0.1_wp
    integer :: i, k, node

    self%share = share
    self%least_share = 0.0_wp
    self%gap = max(gap, 0.0_wp)
    do k = 1, size(self%node)
      node = self%node(k)
      self%least_gap(node) = huge(1.0_wp)
      do i = self%first(node), self%first(node + 1) - 1
        self%least_gap(node) = min(self%least_gap(node), self%gap(self%around(i)))
      end do
      self%vertex_gap(node) = huge(1.0_wp)
      self%vertex_share(node) = 0.0_wp
      if (self%is_vertex(node)) then
        self%vertex_gap(node) = max(vertex_gap(node), 0.0_wp)
        self%vertex_share(node) = 1.0_wp
        do i = self%first(node), self%first(node + 1) - 1
          self%vertex_share(node) = min(self%vertex_share(node), 1.0_wp - share_beside( &
            self, self%around(i), self%vertex_gap(node), BESIDE_VERTEX))
        end do
      end if
      call sum_pressed_area(self, node)
      if (self%pressed_area(node) >= LEAST * self%area(node)) cycle
      self%least_share(node) = merge(LEAST, 1.0_wp, self%pressed_area(node) > 0.0_wp)
      call sum_pressed_area(self, node)
    end do

  end subroutine contact_surface_take_shares

  pure subroutine sum_pressed_area(surface, node)
    type(contact_surface_t), intent(inout) :: surface
    integer, intent(in) :: node

    integer :: i
    real(wp) :: column(3)

    surface%pressed_area(node) = 0.0_wp
    do i = surface%first(node), surface%first(node + 1) - 1
      column = surface%pressed_mass(surface%around(i), surface%around_corner(i))
      surface%pressed_area(node) = surface%pressed_area(node) + sum(column)
    end do

  end subroutine sum_pressed_area

  pure function contact_surface_near_share(self, facet, corner) result(share)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp) :: share

    share = max(share_beside(self, facet, self%least_gap(self%facet(corner, facet)), APART), &
                LEAST_SHARE)

  end function contact_surface_near_share

  pure function contact_surface_face_share(self, facet, corner) result(share)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp) :: share

    share = self%near_share(facet, corner)
    associate (node => self%facet(corner, facet))
      share = max(min(share, share_beside(self, facet, self%vertex_gap(node), BESIDE_VERTEX)), &
                  LEAST_SHARE)
    end associate

  end function contact_surface_face_share

  !> How much a facet counts beside something else that has a smaller gap.
  pure function share_beside(surface, facet, least_gap, most) result(share)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    !> [length]
    real(wp), intent(in) :: least_gap
    !> How much more it gapes, by its size, from which on it is apart [1].
    real(wp), intent(in) :: most
    !> From 0 to 1.
    real(wp) :: share

    !> What counts as nothing. (Bodies with an interference, or gaps that were taken away, press on
    !> each other across a gap that all facets have.)
    real(wp), parameter :: CLOSED = 0.01_wp

    real(wp) :: more, size_of_facet

    size_of_facet = surface%extent(facet)
    if (surface%n_dim == 3) size_of_facet = sqrt(2.0_wp * size_of_facet)
    ! What is no matter how far has a gap too large to divide
    more = max(surface%gap(facet) - least_gap, 0.0_wp)
    share = (most - more / size_of_facet) / (most - CLOSED)
    share = min(max(share, 0.0_wp), 1.0_wp)

  end function share_beside

  pure function contact_surface_pressed_share(self, facet, corner) result(share)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp) :: share

    share = self%near_share(facet, corner) &
      * max(self%share(facet), self%least_share(self%facet(corner, facet)))

  end function contact_surface_pressed_share

  pure function contact_surface_pressed_mass(self, facet, corner) result(column)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    !> [length^2]; its sums over the facets around a node make its `pressed_area`.
    real(wp) :: column(3)

    real(wp) :: mass(3, 3)

    mass = self%mass(facet)
    column = self%pressed_share(facet, corner) * mass(:, corner)

  end function contact_surface_pressed_mass

  pure subroutine find_boxes(surface, lower, upper)
    type(contact_surface_t), intent(in) :: surface
    !> [length]; shape (3, n_facet).
    real(wp), allocatable, intent(out) :: lower(:, :)
    real(wp), allocatable, intent(out) :: upper(:, :)

    integer :: a, f

    allocate (lower(3, surface%n_facet), upper(3, surface%n_facet))
    do f = 1, surface%n_facet
      lower(:, f) = surface%x(:, surface%facet(1, f))
      upper(:, f) = lower(:, f)
      do a = 2, surface%n_dim
        lower(:, f) = min(lower(:, f), surface%x(:, surface%facet(a, f)))
        upper(:, f) = max(upper(:, f), surface%x(:, surface%facet(a, f)))
      end do
    end do

  end subroutine find_boxes

  pure subroutine contact_surface_update(self, x)
    class(contact_surface_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    integer :: a, f, s
    real(wp) :: angle, backward(3), forward(3)
    real(wp), allocatable :: lower(:, :), upper(:, :)

    self%x = x
    call find_facet_normals(self)
    self%sector_normal = 0.0_wp
    do f = 1, self%n_facet
      do a = 1, self%n_dim
        angle = 1.0_wp
        if (self%n_dim == 3) then
          associate (node => self%facet(:, f))
            forward = x(:, node(NEXT(a))) - x(:, node(a))
            backward = x(:, node(NEXT(NEXT(a)))) - x(:, node(a))
            angle = atan2(norm2(cross_product(forward, backward)), dot_product(forward, backward))
          end associate
        end if
        s = self%sector(a, f)
        self%sector_normal(:, s) = self%sector_normal(:, s) + angle * self%normal(:, f)
      end do
    end do
    do s = 1, self%n_sector
      self%sector_normal(:, s) = normalised(self%sector_normal(:, s))
    end do

    call find_boxes(self, lower, upper)
    call self%tree%refit(lower, upper)

  end subroutine contact_surface_update

  pure subroutine find_facet_normals(surface)
    type(contact_surface_t), intent(inout) :: surface

    integer :: f
    real(wp) :: forward(3)

    do f = 1, surface%n_facet
      associate (node => surface%facet(:, f), x => surface%x)
        forward = x(:, node(2)) - x(:, node(1))
        if (surface%n_dim == 2) then
          surface%normal(:, f) = normalised([forward(2), -forward(1), 0.0_wp])
        else
          surface%normal(:, f) = normalised(cross_product(forward, x(:, node(3)) - x(:, node(1))))
        end if
      end associate
    end do

  end subroutine find_facet_normals

  !> Join the facets around each node over their common sides, where these are not sharp.
  pure subroutine find_sectors(surface)
    type(contact_surface_t), intent(inout) :: surface

    integer :: i, j, joined, k, n_around, node
    integer, allocatable :: part(:)
    real(wp) :: smallest

    allocate (part(maxval(surface%first(2:) - surface%first(:size(surface%first) - 1))))
    smallest = cos(surface%feature_angle)
    surface%n_sector = 0
    surface%is_vertex = .false.
    do k = 1, size(surface%node)
      node = surface%node(k)
      n_around = surface%first(node + 1) - surface%first(node)
      associate (around => surface%around(surface%first(node):surface%first(node + 1) - 1), &
                 corner => surface%around_corner(surface%first(node):surface%first(node + 1) - 1))
        do i = 1, n_around
          part(i) = i
        end do
        do i = 2, n_around
          do j = 1, i - 1
            if (.not. share_side(surface, around(i), around(j), node)) cycle
            if (dot_product(surface%normal(:, around(i)), surface%normal(:, around(j))) &
                < smallest) then
              if (falls_off(surface, around(i), around(j))) surface%is_vertex(node) = .true.
              cycle
            end if
            if (part(j) == part(i)) cycle
            joined = part(i)
            where (part(:i) == joined) part(:i) = part(j)
          end do
        end do
        do i = 1, n_around
          if (part(i) == i) then
            surface%n_sector = surface%n_sector + 1
            surface%sector(corner(i), around(i)) = surface%n_sector
          end if
        end do
        ! A part is called by one of its members
        do i = 1, n_around
          surface%sector(corner(i), around(i)) = surface%sector(corner(part(i)), around(part(i)))
        end do
      end associate
    end do
    deallocate (surface%sector_normal)
    allocate (surface%sector_normal(3, surface%n_sector))

  end subroutine find_sectors

  !> True when a facet lies below the plane of a neighbour.
  pure function falls_off(surface, facet, neighbour) result(falls)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: neighbour
    logical :: falls

    integer :: a
    real(wp) :: middle(3)

    middle = 0.0_wp
    do a = 1, surface%n_dim
      middle = middle + (surface%x(:, surface%facet(a, facet)) &
                         - surface%x(:, surface%facet(1, neighbour))) / surface%n_dim
    end do
    falls = dot_product(middle, surface%normal(:, neighbour)) < 0.0_wp

  end function falls_off

  !> True when two facets around a node have a side there in common.
  pure function share_side(surface, one, other, node) result(shared)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: one
    integer, intent(in) :: other
    integer, intent(in) :: node
    logical :: shared

    integer :: a

    shared = surface%n_dim == 2
    do a = 1, surface%n_dim
      if (surface%facet(a, one) == node) cycle
      shared = shared .or. any(surface%facet(:, other) == surface%facet(a, one))
    end do

  end function share_side

  pure function contact_surface_corners(self, facet) result(corner)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> [length]; in the plane the third is zero.
    real(wp) :: corner(3, 3)

    corner(:, 3) = 0.0_wp
    corner(:, :self%n_dim) = self%x(:, self%facet(:, facet))

  end function contact_surface_corners

  pure function contact_surface_point(self, facet, weight) result(x)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    real(wp), intent(in) :: weight(3)
    !> [length]
    real(wp) :: x(3)

    integer :: a

    x = 0.0_wp
    do a = 1, self%n_dim
      x = x + weight(a) * self%x(:, self%facet(a, facet))
    end do

  end function contact_surface_point

  pure function contact_surface_measure(self, facet, weight) result(area)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> Of the corners at the point.
    real(wp), intent(in) :: weight(3)
    !> [length^2]; at the start of the step.
    real(wp) :: area

    area = self%extent(facet)
    if (self%axisymmetric) then
      area = area * TWO_PI * dot_product(weight(:self%n_dim), self%radius(:, facet))
    end if

  end function contact_surface_measure

  pure function contact_surface_mass(self, facet) result(mass)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> [length^2]; at the start of the step; zero beyond the corners.
    real(wp) :: mass(3, 3)

    integer :: a, b, c, n

    n = self%n_dim
    mass = 0.0_wp
    do b = 1, n
      do a = 1, n
        if (self%axisymmetric) then
          ! Of three linear functions on a line: 1/4 when all are the same, else 1/12
          do c = 1, n
            mass(a, b) = mass(a, b) + TWO_PI * self%extent(facet) * self%radius(c, facet) &
              * merge(3.0_wp, 1.0_wp, a == b .and. b == c) / 12.0_wp
          end do
        else
          mass(a, b) = self%extent(facet) * merge(2.0_wp, 1.0_wp, a == b) / (n * (n + 1))
        end if
      end do
    end do

  end function contact_surface_mass

  pure function contact_surface_gradients(self, facet) result(gradient)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> Of the weight of each corner, in the plane of the facet [1/length].
    real(wp) :: gradient(3, 3)

    integer :: a
    real(wp) :: along(3), area_vector(3)

    gradient = 0.0_wp
    associate (node => self%facet(:, facet), x => self%x)
      if (self%n_dim == 2) then
        along = x(:, node(2)) - x(:, node(1))
        gradient(:, 2) = along / dot_product(along, along)
        gradient(:, 1) = -gradient(:, 2)
      else
        area_vector = cross_product(x(:, node(2)) - x(:, node(1)), x(:, node(3)) - x(:, node(1)))
        area_vector = area_vector / dot_product(area_vector, area_vector)
        do a = 1, 3
          along = x(:, node(NEXT(NEXT(a)))) - x(:, node(NEXT(a)))
          gradient(:, a) = cross_product(area_vector, along)
        end do
      end if
    end associate

  end function contact_surface_gradients

  pure function contact_surface_rise(self, facet, weight) result(rise)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> Of the corners.
    real(wp), intent(in) :: weight(3)
    !> Outward [length].
    real(wp) :: rise

    integer :: k

    rise = 0.0_wp
    do k = 1, 3
      rise = rise + self%bulge(k, facet) * weight(k) * weight(NEXT(k))
    end do

  end function contact_surface_rise

  pure function contact_surface_rise_by_weight(self, facet, weight) result(slope)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: facet
    !> Of the corners.
    real(wp), intent(in) :: weight(3)
    !> [length]
    real(wp) :: slope(3)

    integer :: k

    do k = 1, 3
      slope(k) = self%bulge(k, facet) * weight(NEXT(k)) &
        + self%bulge(NEXT(NEXT(k)), facet) * weight(NEXT(NEXT(k)))
    end do

  end function contact_surface_rise_by_weight

  pure function contact_surface_faces(self, node, normal, limit) result(is_facing)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: node
    !> Out of the other surface.
    real(wp), intent(in) :: normal(3)
    !> Largest cosine of the angle between the normals.
    real(wp), intent(in) :: limit
    logical :: is_facing

    integer :: i

    is_facing = .false.
    do i = self%first(node), self%first(node + 1) - 1
      is_facing = is_facing .or. dot_product( &
        self%sector_normal(:, self%sector(self%around_corner(i), self%around(i))), normal) <= limit
    end do

  end function contact_surface_faces

  pure function contact_surface_is_near(self, nodes, facet) result(near)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: facet
    logical :: near

    integer :: a, i, k

    near = .true.
    do k = 1, size(nodes)
      do i = self%first(nodes(k)), self%first(nodes(k) + 1) - 1
        do a = 1, self%n_dim
          if (any(self%facet(:, facet) == self%facet(a, self%around(i)))) return
        end do
      end do
    end do
    near = .false.

  end function contact_surface_is_near

  pure subroutine contact_surface_normals_at(self, node, n, normal)
    class(contact_surface_t), intent(in) :: self
    integer, intent(in) :: node
    !> Normals, as many as facets around the node and as there is room for.
    integer, intent(out) :: n
    !> Its leading columns; shape (3, room).
    real(wp), intent(out) :: normal(:, :)

    integer :: i

    normal = 0.0_wp
    n = 0
    do i = self%first(node), min(self%first(node + 1), self%first(node) + size(normal, 2)) - 1
      n = n + 1
      normal(:, n) = self%sector_normal(:, self%sector(self%around_corner(i), self%around(i)))
    end do

  end subroutine contact_surface_normals_at

end module swage_contact_surface
