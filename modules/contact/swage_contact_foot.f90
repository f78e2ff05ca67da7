!> Foot of a point on a deformable surface: the nearest of its points that counts, the penetration,
!> and how both change when the point and the corners of the facet move.
!>
!> With the point \(x\), the foot \(y = \sum_j N_j x_j\) and the normal \(n\) out of the surface
!> there, the penetration is \(p = (y - x) \cdot n\), and with \(\delta = dx - \sum_j N_j dx_j\)
!>
!> \(dp = -s \cdot \delta\),
!> \(dN_i = \kappa_i \cdot \delta - p \sum_j (g_i \cdot g_j)(n \cdot dx_j)\),
!> \(dn = W \delta - \sum_j g_j (n \cdot dx_j)\).
!>
!> On a flat facet s is n, κ and g are the gradients of the weights and W is 0. On an edge and at a
!> vertex g and κ are those along the feature, and W is the curvature of the distance. On a smoothed
!> facet y lies on its curved patch, and n is interpolated from the normals of the sectors; the
!> normals and the height of the patch over the facet count as fixed: g is 0.
module swage_contact_foot
  use swage_bounding_tree, only: tree_search_t
  use swage_contact_surface, only: contact_surface_t
  use swage_facet, only: nearest_on_curve, nearest_on_triangle, PLACE_CORNER, PLACE_INSIDE
  use swage_kinds, only: wp
  use swage_rotation, only: cross_product, dyadic, IDENTITY, normalised
  implicit none(type, external)
  private

  public :: contact_foot_t, find_foot, find_gap, is_beside, is_within, thickness_below
  public :: FACING, SELF_FACING

  !> Largest cosine of the angle between the normals of two surfaces that may touch: 100 degrees.
  real(wp), parameter :: FACING = -cos(80.0_wp / 180.0_wp * acos(-1.0_wp))
  !> The same of a surface that meets itself, at the start of the step: 120 degrees. Walls meet in
  !> the root of a fold at every angle.
  real(wp), parameter :: SELF_FACING = -0.5_wp
  !> How far beyond a rim, by the facet, the facet still counts. A node that starts at the rim must
  !> not lose its partner by the first deformation.
  real(wp), parameter :: RIM = 0.1_wp
  !> Smallest distance from a feature, by the facet, with its own curvature.
  real(wp), parameter :: SHARPEST = 0.02_wp
  !> A point this close to a feature, by the facet, lies on it.
  real(wp), parameter :: TOUCHING = 1.0e-12_wp
  integer, parameter :: NEXT(3) = [2, 3, 1]
  !> Normals of which one faces whatever there is.
  real(wp), parameter :: ALL_WAYS(3, 6) = reshape([IDENTITY, -IDENTITY], [3, 6])

  type :: contact_foot_t
    !> 0 when there is no foot.
    integer :: facet = 0
    !> Corners of the facet, of which those beyond the problem's number have the weight 0.
    integer :: node(3) = 0
    real(wp) :: weight(3) = 0.0_wp
    !> [length], positive inside.
    real(wp) :: penetration = 0.0_wp
    !> n, unit, and s.
    real(wp) :: normal(3) = 0.0_wp
    real(wp) :: climb(3) = 0.0_wp
    !> κ and g of the corners [1/length]; W [1/length].
    real(wp) :: pull(3, 3) = 0.0_wp
    real(wp) :: gradient(3, 3) = 0.0_wp
    real(wp) :: turn(3, 3) = 0.0_wp
  end type contact_foot_t

contains

  !> The foot of a point on the nearest facet that faces it.
  !>
  !> A point of the surface itself sees no facet around the nodes next to its own, nor those that it
  !> lies deeper under than counts: they are the other side of its own wall. What it sees else does
  !> not change in a step.
  subroutine find_foot(surface, x, towards, reach, depth, smoothing, foot, own)
    type(contact_surface_t), intent(in) :: surface
    !> [length]
    real(wp), intent(in) :: x(3)
    !> Normals of the point's own surface, of which one must face the facet; shape (3, :).
    real(wp), intent(in) :: towards(:, :)
    !> Largest distance outside and inside that counts [length].
    real(wp), intent(in) :: reach
    real(wp), intent(in) :: depth
    !> Interpolate the normals of the sectors.
    logical, intent(in) :: smoothing
    type(contact_foot_t), intent(out) :: foot
    !> Nodes that the point is a mean of, when they are the surface's own.
    integer, intent(in), optional :: own(:)

    integer :: facet, place
    logical :: found
    real(wp) :: weight(3)

    if (present(own)) then
      call find_nearest(surface, x, towards, max(reach, depth), facet, weight, place, own, depth)
    else
      call find_nearest(surface, x, towards, max(reach, depth), facet, weight, place)
    end if
    if (facet == 0) return
    found = .false.
    if (smoothing) call stand_on_smoothed(surface, x, facet, weight, foot, found)
    if (found .and. present(own)) found = .not. surface%is_near(own, foot%facet)
    if (.not. found) then
      if (place == PLACE_INSIDE) then
        call stand_on_face(surface, x, facet, weight, foot)
      else
        call stand_on_feature(surface, x, towards, facet, weight, place, foot)
      end if
    end if
    if (foot%penetration < -reach .or. foot%penetration > depth) foot%facet = 0
    if (foot%facet == 0) return
    foot%node(:surface%n_dim) = surface%facet(:, foot%facet)

  end subroutine find_foot

  !> Height of a point over the plane of the nearest facet, of those that face it if there are any.
  pure subroutine find_gap(surface, x, towards, bound, gap)
    type(contact_surface_t), intent(in) :: surface
    !> [length]
    real(wp), intent(in) :: x(3)
    !> Normals of the point's own surface; shape (3, :).
    real(wp), intent(in) :: towards(:, :)
    !> Largest distance of the facet [length].
    real(wp), intent(in) :: bound
    !> Negative inside; the bound where no facet is so near [length].
    real(wp), intent(out) :: gap

    integer :: facet, place
    real(wp) :: weight(3)

    gap = bound
    call find_nearest(surface, x, towards, bound, facet, weight, place)
    if (facet == 0) call find_nearest(surface, x, ALL_WAYS, bound, facet, weight, place)
    if (facet == 0) return
    gap = dot_product(x - surface%x(:, surface%facet(1, facet)), surface%normal(:, facet))

  end subroutine find_gap

  !> True for a point inside that has a much shorter way out, through what faces its neighbours.
  !>
  !> Where the corner of one body presses on another body next to an edge, the walls beside the
  !> corner and beside the edge face each other, and lie up to a cell deep in each other over a
  !> sliver.
  pure function is_beside(surface, x, towards, penetration, depth) result(beside)
    type(contact_surface_t), intent(in) :: surface
    !> [length]
    real(wp), intent(in) :: x(3)
    !> Normals of the point's own surface around it; shape (3, :).
    real(wp), intent(in) :: towards(:, :)
    !> Into what faces the point [length].
    real(wp), intent(in) :: penetration
    !> Largest one that counts [length].
    real(wp), intent(in) :: depth
    logical :: beside

    !> Penetration by the largest one below which nobody asks, and the share of it that is much
    !> shorter.
    real(wp), parameter :: DEEP = 0.03_wp, SHORTER = 0.1_wp

    integer :: facet, place
    real(wp) :: weight(3)

    beside = .false.
    if (penetration <= DEEP * depth) return
    call find_nearest(surface, x, towards, SHORTER * penetration, facet, weight, place)
    beside = facet > 0

  end function is_beside

  !> True when the nearest facet, whatever way it faces, has a point inside, deeper than asked.
  pure function is_within(surface, x, depth, bound) result(within)
    type(contact_surface_t), intent(in) :: surface
    !> [length]
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: depth
    !> Largest distance of the facet [length].
    real(wp), intent(in) :: bound
    logical :: within

    integer :: facet, place
    real(wp) :: weight(3)

    within = .false.
    call find_nearest(surface, x, ALL_WAYS, bound, facet, weight, place)
    ! Next to an edge the plane of a facet says nothing
    if (facet == 0 .or. place /= PLACE_INSIDE) return
    within = depth_under(surface, x, facet) > depth

  end function is_within

  pure function is_facing(towards, normal)
    real(wp), intent(in) :: towards(:, :)
    real(wp), intent(in) :: normal(3)
    logical :: is_facing

    integer :: i

    is_facing = .false.
    do i = 1, size(towards, 2)
      if (dot_product(towards(:, i), normal) <= FACING) is_facing = .true.
    end do

  end function is_facing

  !> The facet, of those that face, with the point nearest to x.
  pure subroutine find_nearest(surface, x, towards, bound, facet, weight, place, own, depth)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: towards(:, :)
    real(wp), intent(in) :: bound
    !> 0 when none is within the bound.
    integer, intent(out) :: facet
    real(wp), intent(out) :: weight(3)
    integer, intent(out) :: place
    !> See [[find_foot]]; both or none.
    integer, intent(in), optional :: own(:)
    real(wp), intent(in), optional :: depth

    real(wp), parameter :: STRAIGHT(3, 3) = 0.0_wp

    integer :: candidate, candidate_place
    real(wp) :: candidate_weight(3), corner(3, 3), from(3), s, square
    type(tree_search_t) :: search

    facet = 0
    weight = 0.0_wp
    place = PLACE_INSIDE
    ! A little more, for points exactly at the bound
    call surface%tree%start(x, bound**2 * (1.0_wp + epsilon(1.0_wp)), search)
    do
      call surface%tree%next(search, candidate)
      if (candidate == 0) exit
      if (present(own)) then
        if (.not. sees(surface, own, candidate)) cycle
        if (depth_under(surface, x, candidate) > depth) cycle
      else
        if (.not. is_facing(towards, surface%normal(:, candidate))) cycle
      end if
      corner = surface%corners(candidate)
      if (surface%n_dim == 3) then
        call nearest_on_triangle(corner, STRAIGHT, .true., x, candidate_weight, candidate_place)
      else
        call nearest_on_curve(corner(:, 1), corner(:, 2), STRAIGHT(:, 1), x, s)
        candidate_weight = [1.0_wp - s, s, 0.0_wp]
        candidate_place = PLACE_INSIDE
        if (s <= 0.0_wp) candidate_place = PLACE_CORNER + 1
        if (s >= 1.0_wp) candidate_place = PLACE_CORNER + 2
      end if
      from = x - point_of(corner, candidate_weight)
      square = dot_product(from, from)
      if (square >= search%bound) cycle
      search%bound = square
      facet = candidate
      weight = candidate_weight
      place = candidate_place
    end do

  end subroutine find_nearest

  !> True when a surface meets itself where a point and a facet are, as far as normals tell.
  pure function sees(surface, own, facet)
    type(contact_surface_t), intent(in) :: surface
    !> Nodes that the point is a mean of: one, or those of its facet.
    integer, intent(in) :: own(:)
    integer, intent(in) :: facet
    logical :: sees

    integer :: i

    sees = .false.
    if (surface%is_near(own, facet)) return
    do i = surface%first(own(1)), surface%first(own(1) + 1) - 1
      associate (around => surface%around(i))
        if (size(own) > 1) then
          if (any(surface%facet(:, around) /= own)) cycle
        end if
        sees = sees .or. dot_product(surface%normal_old(:, around), &
                                     surface%normal_old(:, facet)) <= SELF_FACING
      end associate
    end do

  end function sees

  !> True when the surface goes on beyond an edge or a vertex of a facet with what is near a point:
  !> its nearest place is there.
  pure function borders_on_near(surface, own, facet, place) result(borders)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: own(:)
    integer, intent(in) :: facet
    integer, intent(in) :: place
    logical :: borders

    integer :: i

    borders = .false.
    if (place == PLACE_INSIDE) return
    if (surface%n_dim == 3 .and. place <= PLACE_CORNER) then
      associate (other => surface%neighbour(place, facet))
        if (other > 0) borders = surface%is_near(own, other)
      end associate
      return
    end if
    associate (node => surface%facet(place - PLACE_CORNER, facet))
      do i = surface%first(node), surface%first(node + 1) - 1
        borders = borders .or. surface%is_near(own, surface%around(i))
      end do
    end associate

  end function borders_on_near

  !> How deep a point lies under the plane of a facet [length].
  pure function depth_under(surface, x, facet) result(depth)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: facet
    real(wp) :: depth

    depth = dot_product(surface%x(:, surface%facet(1, facet)) - x, surface%normal(:, facet))

  end function depth_under

  !> Distance from a node of a surface to the other side of the wall that it is on.
  pure function thickness_below(surface, node, least, bound) result(thickness)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: node
    !> What is nearer is not the other side of its own wall, but another wall that it has entered
    !> [length].
    real(wp), intent(in) :: least
    !> Where the search ends [length].
    real(wp), intent(in) :: bound
    !> The bound when nothing is nearer [length].
    real(wp) :: thickness

    integer, parameter :: MOST = 32
    real(wp), parameter :: STRAIGHT(3, 3) = 0.0_wp

    integer :: candidate, n, place
    real(wp) :: corner(3, 3), distance, from(3), s, towards(3, MOST), weight(3)
    type(tree_search_t) :: search

    thickness = bound
    call surface%normals_at(node, n, towards)
    associate (x => surface%x(:, node))
      call surface%tree%start(x, bound**2, search)
      do
        call surface%tree%next(search, candidate)
        if (candidate == 0) exit
        if (.not. is_facing(towards(:, :n), surface%normal(:, candidate))) cycle
        if (surface%is_near([node], candidate)) cycle
        if (depth_under(surface, x, candidate) <= 0.0_wp) cycle
        corner = surface%corners(candidate)
        if (surface%n_dim == 3) then
          call nearest_on_triangle(corner, STRAIGHT, .true., x, weight, place)
        else
          call nearest_on_curve(corner(:, 1), corner(:, 2), STRAIGHT(:, 1), x, s)
          weight = [1.0_wp - s, s, 0.0_wp]
          place = PLACE_INSIDE
          if (s <= 0.0_wp) place = PLACE_CORNER + 1
          if (s >= 1.0_wp) place = PLACE_CORNER + 2
        end if
        from = x - point_of(corner, weight)
        distance = norm2(from)
        if (borders_on_near(surface, [node], candidate, place)) then
          distance = depth_under(surface, x, candidate)
        end if
        if (distance > least) thickness = min(thickness, distance)
      end do
    end associate

  end function thickness_below

  pure function point_of(corner, weight) result(y)
    real(wp), intent(in) :: corner(3, 3)
    real(wp), intent(in) :: weight(3)
    real(wp) :: y(3)

    y = weight(1) * corner(:, 1) + weight(2) * corner(:, 2) + weight(3) * corner(:, 3)

  end function point_of

  !> The foot on the plane of a facet.
  pure subroutine stand_on_face(surface, x, facet, weight, foot)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: facet
    !> Of the corners; of any point of the plane.
    real(wp), intent(in) :: weight(3)
    type(contact_foot_t), intent(inout) :: foot

    foot%facet = facet
    foot%weight = weight
    foot%normal = surface%normal(:, facet)
    foot%climb = foot%normal
    foot%penetration = dot_product(point_of(surface%corners(facet), weight) - x, foot%normal)
    foot%gradient = surface%gradients(facet)
    foot%pull = foot%gradient
    foot%turn = 0.0_wp

  end subroutine stand_on_face

  !> The foot on an edge or at a vertex: by the distance, where the surface goes on beyond it.
  subroutine stand_on_feature(surface, x, towards, facet, weight, place, foot)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: towards(:, :)
    integer, intent(in) :: facet
    real(wp), intent(in) :: weight(3)
    integer, intent(in) :: place
    type(contact_foot_t), intent(inout) :: foot

    integer :: first, i, last
    logical :: ends
    real(wp) :: across(3, 3), along(3), away, distance, from(3), gradient(3, 3), out(3), scale, &
      unclipped(3)

    from = x - point_of(surface%corners(facet), weight)
    gradient = surface%gradients(facet)
    scale = 1.0_wp / maxval(norm2(gradient(:, :surface%n_dim), dim=1))

    out = 0.0_wp
    ends = .false.
    if (surface%n_dim == 3 .and. place <= PLACE_CORNER) then
      out = surface%normal(:, facet)
      if (surface%neighbour(place, facet) > 0) then
        out = out + surface%normal(:, surface%neighbour(place, facet))
      end if
      call look_beyond(facet, place)
    else
      associate (node => surface%facet(place - PLACE_CORNER, facet))
        do i = surface%first(node), surface%first(node + 1) - 1
          out = out + share_of(surface, surface%around(i), surface%around_corner(i)) &
            * surface%normal(:, surface%around(i))
          call look_beyond(surface%around(i), surface%around_corner(i))
          if (surface%n_dim == 3) then
            call look_beyond(surface%around(i), NEXT(NEXT(surface%around_corner(i))))
          end if
        end do
      end associate
    end if

    if (ends) then
      unclipped = weight + matmul(from, gradient)
      if (minval(unclipped) < -RIM) return
      call stand_on_face(surface, x, facet, unclipped, foot)
      return
    end if

    foot%facet = facet
    foot%weight = weight
    foot%gradient = 0.0_wp
    if (surface%n_dim == 3 .and. place <= PLACE_CORNER) then
      first = place
      last = NEXT(place)
      along = surface%x(:, surface%facet(last, facet)) - surface%x(:, surface%facet(first, facet))
      foot%gradient(:, last) = along / dot_product(along, along)
      foot%gradient(:, first) = -foot%gradient(:, last)
    end if
    foot%pull = foot%gradient
    foot%turn = 0.0_wp
    distance = norm2(from)
    if (distance <= TOUCHING * scale) then
      foot%penetration = 0.0_wp
      foot%normal = normalised(out)
      foot%climb = foot%normal
      return
    end if
    foot%penetration = sign(distance, -dot_product(from, out))
    foot%normal = -from / foot%penetration
    foot%climb = foot%normal
    across = IDENTITY - dyadic(foot%normal, foot%normal)
    if (surface%n_dim == 2) then
      across(3, 3) = 0.0_wp
    else if (place <= PLACE_CORNER) then
      along = normalised(along)
      across = across - dyadic(along, along)
    end if
    away = sign(max(distance, SHARPEST * scale), foot%penetration)
    foot%turn = -across / away

  contains

    !> Does the surface go on beyond a side, or end?
    subroutine look_beyond(one, side)
      integer, intent(in) :: one
      integer, intent(in) :: side

      integer :: other

      other = surface%neighbour(side, one)
      if (other == 0) then
        ends = .true.
      else if (.not. is_facing(towards, surface%normal(:, other))) then
        ! A wall that rises from the facet does not end it, one that falls does
        if (is_below(surface, other, facet)) ends = .true.
      end if

    end subroutine look_beyond

  end subroutine stand_on_feature

  !> Weight of a facet in the normal at one of its corners: the angle there.
  pure function share_of(surface, facet, corner) result(share)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: corner
    real(wp) :: share

    real(wp) :: backward(3), forward(3)

    share = 1.0_wp
    if (surface%n_dim == 2) return
    associate (node => surface%facet(:, facet), x => surface%x)
      forward = x(:, node(NEXT(corner))) - x(:, node(corner))
      backward = x(:, node(NEXT(NEXT(corner)))) - x(:, node(corner))
    end associate
    share = atan2(norm2(cross_product(forward, backward)), dot_product(forward, backward))

  end function share_of

  !> True when a facet lies on the inner side of the plane of another one at its side.
  pure function is_below(surface, facet, plane)
    type(contact_surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: plane
    logical :: is_below

    integer :: a
    real(wp) :: height

    height = 0.0_wp
    do a = 1, surface%n_dim
      height = height + dot_product(surface%x(:, surface%facet(a, facet)) &
                                    - surface%x(:, surface%facet(1, plane)), &
                                    surface%normal(:, plane))
    end do
    is_below = height < 0.0_wp

  end function is_below

  !> The foot along the interpolated normals, \(x = y(\xi) - p\, n(\xi)\) with y on the patch, by
  !> Newton's method; over to the neighbour where it leaves the facet and the normals go on.
  subroutine stand_on_smoothed(surface, x, start, start_weight, foot, found)
    type(contact_surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: start
    real(wp), intent(in) :: start_weight(3)
    type(contact_foot_t), intent(inout) :: foot
    logical, intent(out) :: found

    integer, parameter :: MAXIMUM_STEPS = 30
    real(wp), parameter :: ROUNDING = 1.0e-13_wp

    integer :: facet, i, lowest, n, previous
    real(wp) :: bend(3, 2), corner(3, 3), dual(3, 2), field(3, 3), frame(3, 3), length, miss(3), &
      normal(3), p, step(3), weight(3), y(3)

    n = surface%n_dim
    found = .false.
    facet = start
    previous = 0
    weight = start_weight
    p = 0.0_wp
    call take_facet()
    do i = 1, MAXIMUM_STEPS
      y = point_of(corner, weight) + surface%rise(facet, weight) * surface%normal(:, facet)
      normal = point_of(field, weight)
      if (i == 1) p = dot_product(y - x, normal) / dot_product(normal, normal)
      miss = x - y + p * normal
      call set_frame()
      step = solved(frame, miss)
      weight(2) = weight(2) + step(1)
      if (n == 3) weight(3) = weight(3) + step(2)
      weight(1) = 1.0_wp - weight(2) - weight(3)
      p = p - step(3)
      if (maxval(abs(weight)) > 4.0_wp) return
      if (maxval(abs(step(:2))) > ROUNDING) cycle
      if (minval(weight) >= -ROUNDING) exit
      lowest = minloc(weight(:n), dim=1)
      if (can_pass(lowest)) then
        call pass(lowest)
        cycle
      end if
      if (minval(weight) < -RIM) return
      exit
    end do
    if (i > MAXIMUM_STEPS) return

    normal = point_of(field, weight)
    length = norm2(normal)
    foot%facet = facet
    foot%weight = weight
    foot%penetration = p * length
    foot%normal = normal / length
    call set_frame()
    ! Rows of the inverse of the frame: what the weights and -p gain by a motion of the point
    dual(:, 1) = cross_product(frame(:, 2), frame(:, 3))
    dual(:, 2) = cross_product(frame(:, 3), frame(:, 1))
    dual = dual / dot_product(frame(:, 1), dual(:, 1))
    foot%gradient = 0.0_wp
    foot%pull = 0.0_wp
    foot%pull(:, 2) = dual(:, 1)
    if (n == 3) foot%pull(:, 3) = dual(:, 2)
    foot%pull(:, 1) = -foot%pull(:, 2) - foot%pull(:, 3)
    bend = 0.0_wp
    bend(:, 1) = field(:, 2) - field(:, 1)
    if (n == 3) bend(:, 2) = field(:, 3) - field(:, 1)
    foot%turn = 0.0_wp
    do i = 1, n - 1
      ! The penetration counts in lengths of the unit normal
      frame(:, i) = frame(:, i) + p * dot_product(bend(:, i), foot%normal) * foot%normal
      bend(:, i) = (bend(:, i) - dot_product(bend(:, i), foot%normal) * foot%normal) / length
      foot%turn = foot%turn + dyadic(bend(:, i), dual(:, i))
    end do
    foot%climb = cross_product(frame(:, 1), frame(:, 2))
    foot%climb = foot%climb / dot_product(foot%climb, foot%normal)
    found = .true.

  contains

    subroutine take_facet()
      integer :: a

      corner = surface%corners(facet)
      field = 0.0_wp
      do a = 1, n
        field(:, a) = surface%sector_normal(:, surface%sector(a, facet))
      end do

    end subroutine take_facet

    !> How x changes with the weights and with -p.
    subroutine set_frame()

      real(wp) :: climb(3)

      climb = surface%rise_by_weight(facet, weight)
      frame(:, 1) = corner(:, 2) - corner(:, 1) - p * (field(:, 2) - field(:, 1)) &
        + (climb(2) - climb(1)) * surface%normal(:, facet)
      frame(:, 2) = [0.0_wp, 0.0_wp, 1.0_wp]
      if (n == 3) then
        frame(:, 2) = corner(:, 3) - corner(:, 1) - p * (field(:, 3) - field(:, 1)) &
          + (climb(3) - climb(1)) * surface%normal(:, facet)
      end if
      frame(:, 3) = normal

    end subroutine set_frame

    !> True when the normals go on over the side opposite to a corner.
    function can_pass(opposite) result(passes)
      integer, intent(in) :: opposite
      logical :: passes

      integer :: a, b, other, side

      side = merge(3 - opposite, NEXT(opposite), n == 2)
      other = surface%neighbour(side, facet)
      passes = other > 0 .and. other /= previous
      if (.not. passes) return
      do a = 1, n
        if (a == opposite) cycle
        do b = 1, n
          if (surface%facet(b, other) /= surface%facet(a, facet)) cycle
          passes = passes .and. surface%sector(b, other) == surface%sector(a, facet)
        end do
      end do

    end function can_pass

    !> Go over that side, to the point of the neighbour nearest to where the facet was left.
    subroutine pass(opposite)
      integer, intent(in) :: opposite

      integer :: a, b
      real(wp) :: old(3)

      old = max(weight, 0.0_wp)
      old(opposite) = 0.0_wp
      old = old / sum(old)
      previous = facet
      facet = surface%neighbour(merge(3 - opposite, NEXT(opposite), n == 2), previous)
      weight = 0.0_wp
      do b = 1, n
        do a = 1, n
          if (surface%facet(b, facet) == surface%facet(a, previous)) weight(b) = old(a)
        end do
      end do
      call take_facet()

    end subroutine pass

  end subroutine stand_on_smoothed

  !> Solution of three equations, by Cramer's rule; 0 when there is none.
  pure function solved(matrix, right) result(solution)
    real(wp), intent(in) :: matrix(3, 3)
    real(wp), intent(in) :: right(3)
    real(wp) :: solution(3)

    real(wp) :: minor(3), volume

    minor = cross_product(matrix(:, 2), matrix(:, 3))
    volume = dot_product(matrix(:, 1), minor)
    solution = 0.0_wp
    if (.not. abs(volume) > 0.0_wp) return
    solution(1) = dot_product(right, minor) / volume
    solution(2) = dot_product(right, cross_product(matrix(:, 3), matrix(:, 1))) / volume
    solution(3) = dot_product(right, cross_product(matrix(:, 1), matrix(:, 2))) / volume

  end function solved

end module swage_contact_foot
