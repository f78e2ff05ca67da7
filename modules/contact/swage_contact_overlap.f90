!> Quadrature points of a slave surface, each with the point of the master that it meets.
!>
!> The way from a point x of the slave to the master goes along the slave's normal n, either that of
!> the facet or, smoothed, the one interpolated from the normals of its sectors:
!> \(x = y + p\, n\) with the penetration p. Smoothed, x and y lie on the curved patches of
!> [[swage_contact_surface]], whose heights over the facets count as fixed in all derivatives.
!>
!> `clipped`: each slave facet is cut into the pieces that it has in common with master facets seen
!> along its normal (Sutherland and Hodgman), and these are integrated exactly. `slave`: a rule of
!> points on the whole slave facet. Parts without a master facet have no points.
module swage_contact_overlap
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_surface, only: contact_surface_t
  use swage_facet_quadrature, only: facet_quadrature
  use swage_kinds, only: wp
  use swage_rotation, only: normalised
  implicit none(type, external)
  private

  public :: contact_overlap_t, overlap_point_t, find_overlap

  !> A piece smaller than this share of its facet is rounding.
  real(wp), parameter :: SMALLEST_PIECE = 1.0e-13_wp
  !> A point this far outside a facet, by weight, still meets it: none falls between two.
  real(wp), parameter :: ON_SIDE = 1.0e-9_wp
  !> Smallest cosine between the normals along which a point is sent.
  real(wp), parameter :: SLANTED = 0.05_wp
  !> Corners of a piece of a triangle cut by another one.
  integer, parameter :: MOST_CORNERS = 9

  type :: overlap_point_t
    integer :: slave_facet = 0
    integer :: master_facet = 0
    !> Weights of the corners of both.
    real(wp) :: slave_weight(3) = 0.0_wp
    real(wp) :: master_weight(3) = 0.0_wp
    !> [length^2], at the start of the step.
    real(wp) :: area = 0.0_wp
    !> [length]
    real(wp) :: penetration = 0.0_wp
    !> Out of the slave.
    real(wp) :: normal(3) = 0.0_wp
    !> Derivative of the penetration by a motion of the point.
    real(wp) :: climb(3) = 0.0_wp
  end type overlap_point_t

  !> Points in the order of the slave facets: those of facet f are `first(f)` to `first(f + 1) - 1`.
  type :: contact_overlap_t
    integer :: n = 0
    type(overlap_point_t), allocatable :: point(:)
    integer, allocatable :: first(:)
    !> True when the points are exact on the pieces that facets have in common; else the number of
    !> points on a slave facet.
    logical :: clipped = .true.
    integer :: n_point = 3
  end type contact_overlap_t

  !> How points of a slave facet reach the plane of a master one.
  type :: beam_t
    integer :: slave_facet = 0
    integer :: master_facet = 0
    !> True when all points go the same way: what they meet is linear in their weights.
    logical :: is_straight = .false.
    !> Of straight ones: whether the planes are not too slanted, the normal, how the penetration
    !> changes with the point, and penetration [length] and weights on the master of the slave's
    !> corners, corners last.
    logical :: meets = .false.
    real(wp) :: normal(3) = 0.0_wp
    real(wp) :: climb(3) = 0.0_wp
    real(wp) :: penetration(3) = 0.0_wp
    real(wp) :: weight(3, 3) = 0.0_wp
  end type beam_t

contains

  !> Find the points of all slave facets with a node of this rank.
  subroutine find_overlap(pair, mine, overlap)
    type(contact_pair_t), intent(in) :: pair
    !> Shape (n_node).
    logical, intent(in) :: mine(:)
    !> Its rule is kept.
    type(contact_overlap_t), intent(inout) :: overlap

    !> Points on a piece of a line: exact to degree 5; on one of a triangle, to degree 2.
    integer, parameter :: PIECE_POINTS = 3

    integer :: f
    integer, allocatable :: candidate(:)
    real(wp), allocatable :: barycentric(:, :), weight(:)

    if (.not. allocated(overlap%point)) allocate (overlap%point(64))
    if (allocated(overlap%first)) deallocate (overlap%first)
    allocate (overlap%first(pair%slave%n_facet + 1))
    overlap%n = 0
    call facet_quadrature(pair%slave%n_dim, merge(PIECE_POINTS, overlap%n_point, overlap%clipped), &
                          barycentric, weight)
    do f = 1, pair%slave%n_facet
      overlap%first(f) = overlap%n + 1
      if (.not. any(mine(pair%slave%facet(:, f)))) cycle
      call find_candidates(pair, f, candidate)
      if (size(candidate) == 0) cycle
      if (.not. overlap%clipped) then
        call add_whole_facet(pair, f, candidate, barycentric, weight, overlap)
      else if (pair%slave%n_dim == 2) then
        call add_pieces_of_line(pair, f, candidate, barycentric, weight, overlap)
      else
        call add_pieces_of_triangle(pair, f, candidate, barycentric, weight, overlap)
      end if
    end do
    overlap%first(pair%slave%n_facet + 1) = overlap%n + 1

  end subroutine find_overlap

  !> Master facets within reach that face a slave facet.
  subroutine find_candidates(pair, f, candidate)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, allocatable, intent(out) :: candidate(:)

    integer :: a, i, n
    real(wp) :: lower(3), normal(3), upper(3)

    lower = huge(1.0_wp)
    upper = -huge(1.0_wp)
    do a = 1, pair%slave%n_dim
      associate (x => pair%slave%x(:, pair%slave%facet(a, f)))
        normal = pair%slave%normal(:, f)
        lower = min(lower, x + pair%reach * normal, x - pair%depth * normal)
        upper = max(upper, x + pair%reach * normal, x - pair%depth * normal)
        if (.not. pair%smoothing) cycle
        normal = pair%slave%sector_normal(:, pair%slave%sector(a, f))
        lower = min(lower, x + pair%reach * normal, x - pair%depth * normal)
        upper = max(upper, x + pair%reach * normal, x - pair%depth * normal)
      end associate
    end do
    call pair%master%tree%candidates(lower, upper, candidate)
    n = 0
    do i = 1, size(candidate)
      if (.not. pair%may_meet(f, candidate(i))) cycle
      n = n + 1
      candidate(n) = candidate(i)
    end do
    candidate = candidate(:n)

  end subroutine find_candidates

  pure subroutine aim(pair, f, m, beam)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, intent(in) :: m
    type(beam_t), intent(out) :: beam

    integer :: a
    real(wp) :: cosine, from(3), gradient(3, 3)

    beam%slave_facet = f
    beam%master_facet = m
    beam%is_straight = .not. pair%smoothing
    if (.not. beam%is_straight) return
    associate (slave => pair%slave, master => pair%master)
      beam%normal = slave%normal(:, f)
      cosine = dot_product(beam%normal, master%normal(:, m))
      beam%meets = cosine < -SLANTED
      if (.not. beam%meets) return
      beam%climb = master%normal(:, m) / cosine
      gradient = master%gradients(m)
      do a = 1, slave%n_dim
        from = slave%x(:, slave%facet(a, f)) - master%x(:, master%facet(1, m))
        beam%penetration(a) = dot_product(master%normal(:, m), from) / cosine
        beam%weight(:, a) = weights_at(from - beam%penetration(a) * beam%normal, gradient)
      end do
    end associate

  end subroutine aim

  !> Send a point of a slave facet to the plane of a master facet.
  pure subroutine send(pair, beam, slave_weight, point, meets)
    type(contact_pair_t), intent(in) :: pair
    type(beam_t), intent(in) :: beam
    real(wp), intent(in) :: slave_weight(3)
    !> All but its area.
    type(overlap_point_t), intent(out) :: point
    !> False when it is too far, or the planes too slanted.
    logical, intent(out) :: meets

    point%slave_facet = beam%slave_facet
    point%master_facet = beam%master_facet
    point%slave_weight = slave_weight
    if (beam%is_straight) then
      meets = beam%meets
      if (.not. meets) return
      point%normal = beam%normal
      point%climb = beam%climb
      point%penetration = dot_product(beam%penetration, slave_weight)
      point%master_weight = beam%weight(:, 1) * slave_weight(1) &
        + beam%weight(:, 2) * slave_weight(2) + beam%weight(:, 3) * slave_weight(3)
      meets = point%penetration >= -pair%reach .and. &
        point%penetration <= pair%depth_at(pair%slave%facet(:, beam%slave_facet))
    else
      call send_along_smoothed(pair, point, meets)
    end if
    if (.not. meets) return
    meets = .not. pair%is_beside(pair%slave, pair%master, beam%slave_facet, &
                                 pair%slave%point(beam%slave_facet, slave_weight), &
                                 point%penetration)

  end subroutine send

  pure subroutine send_along_smoothed(pair, point, meets)
    type(contact_pair_t), intent(in) :: pair
    !> With its facets and its place on the slave.
    type(overlap_point_t), intent(inout) :: point
    !> False when it is too far, or the planes too slanted.
    logical, intent(out) :: meets

    !> The height of the master's patch hardly changes along a normal: each step gains two digits.
    integer, parameter :: STEPS = 6

    integer :: a, i
    real(wp) :: cosine, from(3), gradient(3, 3), height, rise

    associate (slave => pair%slave, master => pair%master, f => point%slave_facet, &
               m => point%master_facet)
      point%normal = 0.0_wp
      do a = 1, slave%n_dim
        point%normal = point%normal &
          + point%slave_weight(a) * slave%sector_normal(:, slave%sector(a, f))
      end do
      point%normal = normalised(point%normal)
      cosine = dot_product(point%normal, master%normal(:, m))
      meets = cosine < -SLANTED
      if (.not. meets) return
      from = slave%point(f, point%slave_weight) - master%x(:, master%facet(1, m))
      height = dot_product(master%normal(:, m), from)
      rise = slave%rise(f, point%slave_weight)
      from = from + rise * slave%normal(:, f)
      height = height + rise * dot_product(master%normal(:, m), slave%normal(:, f))
      point%penetration = height / cosine
      gradient = master%gradients(m)
      point%master_weight = weights_at(from - point%penetration * point%normal, gradient)
      point%climb = master%normal(:, m)
      if (any(abs(master%bulge(:, m)) > 0.0_wp)) then
        do i = 1, STEPS
          point%penetration = (height - master%rise(m, point%master_weight)) / cosine
          point%master_weight = weights_at(from - point%penetration * point%normal, gradient)
        end do
        point%climb = point%climb - matmul(gradient, master%rise_by_weight(m, point%master_weight))
      end if
      meets = point%penetration >= -pair%reach .and. &
        point%penetration <= pair%depth_at(slave%facet(:, f)) .and. &
        dot_product(point%climb, point%normal) < -SLANTED
      if (.not. meets) return
      point%climb = point%climb / dot_product(point%climb, point%normal)
    end associate

  end subroutine send_along_smoothed

  !> Weights of the corners at a point of a facet.
  pure function weights_at(from, gradient) result(weight)
    !> From the first corner to the point [length].
    real(wp), intent(in) :: from(3)
    !> Of the weights [1/length].
    real(wp), intent(in) :: gradient(3, 3)
    real(wp) :: weight(3)

    weight = matmul(from, gradient)
    weight(1) = 1.0_wp - weight(2) - weight(3)

  end function weights_at

  !> A rule on the whole facet; each point goes to the nearest facet it meets.
  subroutine add_whole_facet(pair, f, candidate, barycentric, weight, overlap)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, intent(in) :: candidate(:)
    real(wp), intent(in) :: barycentric(:, :)
    real(wp), intent(in) :: weight(:)
    type(contact_overlap_t), intent(inout) :: overlap

    integer :: i, q
    logical :: meets
    type(beam_t) :: beam(size(candidate))
    type(overlap_point_t) :: best, point

    do i = 1, size(candidate)
      call aim(pair, f, candidate(i), beam(i))
    end do
    do q = 1, size(weight)
      best%master_facet = 0
      do i = 1, size(candidate)
        call send(pair, beam(i), barycentric(:, q), point, meets)
        if (.not. meets) cycle
        if (minval(point%master_weight(:pair%master%n_dim)) < -ON_SIDE) cycle
        if (best%master_facet > 0) then
          if (abs(point%penetration) >= abs(best%penetration)) cycle
        end if
        best = point
      end do
      if (best%master_facet == 0) cycle
      best%area = weight(q) * pair%slave%measure(f, barycentric(:, q))
      call append(overlap, best)
    end do

  end subroutine add_whole_facet

  !> Pieces between the ends of all candidates; of several over one piece the nearest counts.
  subroutine add_pieces_of_line(pair, f, candidate, barycentric, weight, overlap)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, intent(in) :: candidate(:)
    real(wp), intent(in) :: barycentric(:, :)
    real(wp), intent(in) :: weight(:)
    type(contact_overlap_t), intent(inout) :: overlap

    integer :: best, i, n, piece, q
    logical :: meets
    real(wp) :: cut(2 * size(candidate) + 2), high(size(candidate)), low(size(candidate)), middle, &
      nearest, slave_weight(3)
    type(beam_t) :: beam(size(candidate))
    type(overlap_point_t) :: point

    cut(1:2) = [0.0_wp, 1.0_wp]
    n = 2
    do i = 1, size(candidate)
      call aim(pair, f, candidate(i), beam(i))
      associate (one => place(pair%master%facet(1, candidate(i))), &
                 two => place(pair%master%facet(2, candidate(i))))
        low(i) = max(min(one, two), 0.0_wp)
        high(i) = min(max(one, two), 1.0_wp)
      end associate
      if (high(i) <= low(i)) cycle
      cut(n + 1:n + 2) = [low(i), high(i)]
      n = n + 2
    end do
    call sort(cut(:n))
    do piece = 1, n - 1
      if (cut(piece + 1) - cut(piece) <= SMALLEST_PIECE) cycle
      middle = 0.5_wp * (cut(piece) + cut(piece + 1))
      best = 0
      nearest = huge(1.0_wp)
      do i = 1, size(candidate)
        if (middle < low(i) .or. middle > high(i)) cycle
        call send(pair, beam(i), [1.0_wp - middle, middle, 0.0_wp], point, meets)
        if (.not. meets .or. abs(point%penetration) >= nearest) cycle
        nearest = abs(point%penetration)
        best = i
      end do
      if (best == 0) cycle
      do q = 1, size(weight)
        middle = barycentric(1, q) * cut(piece) + barycentric(2, q) * cut(piece + 1)
        slave_weight = [1.0_wp - middle, middle, 0.0_wp]
        call send(pair, beam(best), slave_weight, point, meets)
        if (.not. meets) cycle
        point%area = weight(q) * (cut(piece + 1) - cut(piece)) * pair%slave%measure(f, slave_weight)
        call append(overlap, point)
      end do
    end do

  contains

    !> Where a node of the master lies along the facet.
    pure function place(node) result(along)
      integer, intent(in) :: node
      real(wp) :: along

      real(wp) :: side(3)

      associate (slave => pair%slave)
        side = slave%x(:, slave%facet(2, f)) - slave%x(:, slave%facet(1, f))
        along = dot_product(pair%master%x(:, node) - slave%x(:, slave%facet(1, f)), side) &
          / dot_product(side, side)
      end associate

    end function place

  end subroutine add_pieces_of_line

  !> Sort a short list.
  pure subroutine sort(list)
    real(wp), intent(inout) :: list(:)

    integer :: i, j
    real(wp) :: value

    do i = 2, size(list)
      value = list(i)
      j = i - 1
      do while (j > 0)
        if (list(j) <= value) exit
        list(j + 1) = list(j)
        j = j - 1
      end do
      list(j + 1) = value
    end do

  end subroutine sort

  !> Pieces that a slave triangle has in common with each candidate.
  subroutine add_pieces_of_triangle(pair, f, candidate, barycentric, weight, overlap)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, intent(in) :: candidate(:)
    real(wp), intent(in) :: barycentric(:, :)
    real(wp), intent(in) :: weight(:)
    type(contact_overlap_t), intent(inout) :: overlap

    integer :: begin, i, k, n_corner, q
    logical :: meets
    real(wp) :: covered, gradient(3, 3), piece(2, MOST_CORNERS), share, shadow(2, 3), &
      slave_weight(3)
    type(beam_t) :: beam
    type(overlap_point_t) :: point

    begin = overlap%n + 1
    covered = 0.0_wp
    gradient = pair%slave%gradients(f)
    do i = 1, size(candidate)
      call cast_shadow(pair, f, gradient, candidate(i), shadow)
      ! Wholly beyond a side
      if (all(shadow(1, :) <= 0.0_wp) .or. all(shadow(2, :) <= 0.0_wp) .or. &
          all(shadow(1, :) + shadow(2, :) >= 1.0_wp)) cycle
      call cut_triangle(shadow, piece, n_corner)
      if (n_corner < 3) cycle
      call aim(pair, f, candidate(i), beam)
      do k = 2, n_corner - 1
        ! By the whole facet, whose area is 1/2 in these coordinates
        share = abs((piece(1, k) - piece(1, 1)) * (piece(2, k + 1) - piece(2, 1)) &
                    - (piece(2, k) - piece(2, 1)) * (piece(1, k + 1) - piece(1, 1)))
        if (share <= SMALLEST_PIECE) cycle
        do q = 1, size(weight)
          slave_weight(2:3) = barycentric(1, q) * piece(:, 1) + barycentric(2, q) * piece(:, k) &
            + barycentric(3, q) * piece(:, k + 1)
          slave_weight(1) = 1.0_wp - slave_weight(2) - slave_weight(3)
          call send(pair, beam, slave_weight, point, meets)
          if (.not. meets) cycle
          point%area = weight(q) * share * pair%slave%measure(f, slave_weight)
          covered = covered + weight(q) * share
          call append(overlap, point)
        end do
      end do
    end do
    if (covered > 1.0_wp + 1.0e-6_wp) call keep_nearest(pair, f, candidate, begin, overlap)

  end subroutine add_pieces_of_triangle

  !> Where the corners of a master triangle lie on the plane of a slave one: weights 2 and 3 there.
  pure subroutine cast_shadow(pair, f, gradient, m, shadow)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    !> Of the slave facet.
    real(wp), intent(in) :: gradient(3, 3)
    integer, intent(in) :: m
    real(wp), intent(out) :: shadow(2, 3)

    integer :: a

    do a = 1, 3
      shadow(:, a) = matmul(pair%master%x(:, pair%master%facet(a, m)) &
                            - pair%slave%x(:, pair%slave%facet(1, f)), gradient(:, 2:3))
    end do

  end subroutine cast_shadow

  !> The part of the triangle (0, 0), (1, 0), (0, 1) within another one.
  pure subroutine cut_triangle(shadow, piece, n_corner)
    real(wp), intent(in) :: shadow(2, 3)
    real(wp), intent(out) :: piece(2, MOST_CORNERS)
    !> Below 3 when there is none.
    integer, intent(out) :: n_corner

    integer :: i, j, n, side
    real(wp) :: along(2), height, height_next, old(2, MOST_CORNERS), turn

    piece = 0.0_wp
    piece(1, 2) = 1.0_wp
    piece(2, 3) = 1.0_wp
    n_corner = 3
    turn = (shadow(1, 2) - shadow(1, 1)) * (shadow(2, 3) - shadow(2, 1)) &
      - (shadow(2, 2) - shadow(2, 1)) * (shadow(1, 3) - shadow(1, 1))
    turn = sign(1.0_wp, turn)
    do side = 1, 3
      old = piece
      n = n_corner
      n_corner = 0
      along = turn * (shadow(:, 1 + mod(side, 3)) - shadow(:, side))
      do i = 1, n
        j = 1 + mod(i, n)
        height = over(old(:, i))
        height_next = over(old(:, j))
        if (height >= 0.0_wp) then
          n_corner = n_corner + 1
          piece(:, n_corner) = old(:, i)
        end if
        if ((height > 0.0_wp .and. height_next < 0.0_wp) .or. &
            (height < 0.0_wp .and. height_next > 0.0_wp)) then
          n_corner = n_corner + 1
          piece(:, n_corner) = (height * old(:, j) - height_next * old(:, i)) &
            / (height - height_next)
        end if
      end do
    end do

  contains

    !> Positive inside the present side.
    pure function over(x) result(above)
      real(wp), intent(in) :: x(2)
      real(wp) :: above

      above = along(1) * (x(2) - shadow(2, side)) - along(2) * (x(1) - shadow(1, side))

    end function over

  end subroutine cut_triangle

  !> Where facets of the master lie one above the other, drop the points of those further away.
  subroutine keep_nearest(pair, f, candidate, begin, overlap)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: f
    integer, intent(in) :: candidate(:)
    !> First point of the facet.
    integer, intent(in) :: begin
    type(contact_overlap_t), intent(inout) :: overlap

    integer :: i, n, q
    logical :: keep, meets
    type(beam_t) :: beam(size(candidate))
    type(overlap_point_t) :: point

    do i = 1, size(candidate)
      call aim(pair, f, candidate(i), beam(i))
    end do

    n = begin - 1
    do q = begin, overlap%n
      keep = .true.
      do i = 1, size(candidate)
        if (candidate(i) == overlap%point(q)%master_facet) cycle
        call send(pair, beam(i), overlap%point(q)%slave_weight, point, meets)
        if (.not. meets) cycle
        if (minval(point%master_weight) < ON_SIDE) cycle
        keep = keep .and. abs(point%penetration) >= abs(overlap%point(q)%penetration)
      end do
      if (.not. keep) cycle
      n = n + 1
      overlap%point(n) = overlap%point(q)
    end do
    overlap%n = n

  end subroutine keep_nearest

  pure subroutine append(overlap, point)
    type(contact_overlap_t), intent(inout) :: overlap
    type(overlap_point_t), intent(in) :: point

    type(overlap_point_t), allocatable :: longer(:)

    if (overlap%n == size(overlap%point)) then
      allocate (longer(2 * overlap%n))
      longer(:overlap%n) = overlap%point
      call move_alloc(longer, overlap%point)
    end if
    overlap%n = overlap%n + 1
    overlap%point(overlap%n) = point

  end subroutine append

end module swage_contact_overlap
