!> Geometry of one facet, flat or curved: the nearest of its points, and how the distance changes.
!>
!> A triangle with corners \(p_k\) and weights \(\lambda_k\) is
!> \(S = \sum_k \lambda_k p_k - \sum_k \lambda_k \lambda_{k+1} c_k\), a line
!> \(E = (1-s) p_1 + s p_2 - s (1-s) c_1\): quadratic, with the sides as such lines. A bend c = 0 is
!> straight. Source: T. Nagata, Comput. Aided Geom. Des. 22 (2005) 327–347.
module swage_facet
  use swage_kinds, only: wp
  use swage_rotation, only: cross_product, dyadic, IDENTITY
  implicit none(type, external)
  private

  public :: bend_between, curve_distance, nearest_on_curve, nearest_on_triangle, point_distance
  public :: side_tangents, surface_distance, triangle_point
  public :: PLACE_INSIDE, PLACE_SIDE, PLACE_CORNER

  !> Where the nearest point is: inside the facet; on its side k: `PLACE_SIDE + k`; at its corner k:
  !> `PLACE_CORNER + k`.
  integer, parameter :: PLACE_INSIDE = 0, PLACE_SIDE = 0, PLACE_CORNER = 3

  !> A change of the weights below this is rounding.
  real(wp), parameter :: ROUNDING = 1.0e-13_wp
  integer, parameter :: MAXIMUM_ITERATIONS = 20
  !> Next corner of a triangle.
  integer, parameter :: NEXT(3) = [2, 3, 1]
  !> Largest bend of a sharp edge, and largest component of any along its side, by the length of the
  !> side: beyond, the line would run back at one of its ends.
  real(wp), parameter :: LARGEST_BEND = 0.3_wp, LARGEST_DRIFT = 0.2_wp

contains

  !> The bend of a line so that it is at right angles to given normals at its ends: the smallest
  !> that does, c·n = ±(n·d). Where a sharp edge has two normals at an end, both count.
  pure function bend_between(side, normals_first, normals_last) result(bend)
    !> From the first end to the last [length].
    real(wp), intent(in) :: side(3)
    !> Unit vectors; shape (3, 1 or 2).
    real(wp), intent(in) :: normals_first(:, :)
    real(wp), intent(in) :: normals_last(:, :)
    real(wp) :: bend(3)

    !> Square of the angle between normals below which their difference is noise, 0.02 in radian.
    real(wp), parameter :: SMALLEST = 4.0e-4_wp

    real(wp) :: apart(3), both(3), drift(3), first, last

    if (size(normals_first, 2) > 1) then
      bend = bend_of_edge(side, normals_first, normals_last)
      return
    end if
    both = normals_first(:, 1) + normals_last(:, 1)
    apart = normals_first(:, 1) - normals_last(:, 1)
    first = dot_product(normals_first(:, 1), side)
    last = -dot_product(normals_last(:, 1), side)
    bend = (first + last) / dot_product(both, both) * both
    ! Where the normals hardly differ, noise in them would be blown up
    if (dot_product(apart, apart) > SMALLEST) then
      drift = (first - last) / dot_product(apart, apart) * apart
      if (norm2(drift) <= LARGEST_DRIFT * norm2(side)) bend = bend + drift
    end if

  end function bend_between

  !> The same with two normals at each end, in the sense of least squares.
  pure function bend_of_edge(side, normals_first, normals_last) result(bend)
    real(wp), intent(in) :: side(3)
    real(wp), intent(in) :: normals_first(:, :)
    real(wp), intent(in) :: normals_last(:, :)
    real(wp) :: bend(3)

    !> Share of the identity in the matrix, where the normals leave a direction open.
    real(wp), parameter :: OPEN_DIRECTION = 1.0e-9_wp

    integer :: i
    real(wp) :: matrix(3, 3), right(3)

    matrix = OPEN_DIRECTION * IDENTITY
    right = 0.0_wp
    do i = 1, size(normals_first, 2)
      matrix = matrix + dyadic(normals_first(:, i), normals_first(:, i))
      right = right + normals_first(:, i) * dot_product(normals_first(:, i), side)
    end do
    do i = 1, size(normals_last, 2)
      matrix = matrix + dyadic(normals_last(:, i), normals_last(:, i))
      right = right - normals_last(:, i) * dot_product(normals_last(:, i), side)
    end do
    bend = solved(matrix, right)
    if (norm2(bend) > LARGEST_BEND * norm2(side)) bend = 0.0_wp

  end function bend_of_edge

  !> Solution of three equations, by Cramer's rule.
  pure function solved(matrix, right) result(x)
    real(wp), intent(in) :: matrix(3, 3)
    real(wp), intent(in) :: right(3)
    real(wp) :: x(3)

    real(wp) :: minor(3)

    minor = cross_product(matrix(:, 2), matrix(:, 3))
    x(1) = dot_product(right, minor)
    x(2) = dot_product(right, cross_product(matrix(:, 3), matrix(:, 1)))
    x(3) = dot_product(right, cross_product(matrix(:, 1), matrix(:, 2)))
    x = x / dot_product(matrix(:, 1), minor)

  end function solved

  !> The point of a triangle nearest to x.
  pure subroutine nearest_on_triangle(corner, bend, flat, x, weight, place)
    !> [length]; shape (3, 3).
    real(wp), intent(in) :: corner(3, 3)
    !> Of the side from each corner to the next [length].
    real(wp), intent(in) :: bend(3, 3)
    !> True when all bends are 0.
    logical, intent(in) :: flat
    real(wp), intent(in) :: x(3)
    !> Of the corners.
    real(wp), intent(out) :: weight(3)
    integer, intent(out) :: place

    integer :: k
    real(wp) :: from(3), s, smallest, square, y(3)

    call find_inside(corner, bend, flat, x, weight, place)
    if (place == PLACE_INSIDE) return
    smallest = huge(1.0_wp)
    do k = 1, 3
      call nearest_on_curve(corner(:, k), corner(:, NEXT(k)), bend(:, k), x, s)
      y = curve_point(corner(:, k), corner(:, NEXT(k)), bend(:, k), s)
      from = x - y
      square = dot_product(from, from)
      if (square >= smallest) cycle
      smallest = square
      weight = 0.0_wp
      weight(k) = 1.0_wp - s
      weight(NEXT(k)) = s
      place = PLACE_SIDE + k
      if (s <= 0.0_wp) place = PLACE_CORNER + k
      if (s >= 1.0_wp) place = PLACE_CORNER + NEXT(k)
    end do

  end subroutine nearest_on_triangle

  !> A foot of the perpendicular inside a triangle, by Newton's method from that on the flat one.
  pure subroutine find_inside(corner, bend, flat, x, weight, place)
    real(wp), intent(in) :: corner(3, 3), bend(3, 3)
    logical, intent(in) :: flat
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: weight(3)
    !> Anything but `PLACE_INSIDE` when there is none.
    integer, intent(out) :: place

    real(wp) :: derivative(3, 2), det, from(3), g(2), matrix(2, 2), metric(2, 2), second(3, 3), &
      step(2)
    integer :: iteration

    place = PLACE_CORNER
    weight = 1.0_wp / 3.0_wp
    if (.not. flat) weight = weight_on_plane(corner, x)
    do iteration = 1, MAXIMUM_ITERATIONS
      call side_tangents(corner, bend, weight, derivative, second)
      from = x - triangle_point(corner, bend, weight)
      g = matmul(from, derivative)
      metric = matmul(transpose(derivative), derivative)
      matrix(1, 1) = metric(1, 1) - dot_product(from, second(:, 1))
      matrix(2, 2) = metric(2, 2) - dot_product(from, second(:, 2))
      matrix(1, 2) = metric(1, 2) - dot_product(from, second(:, 3))
      matrix(2, 1) = matrix(1, 2)
      det = matrix(1, 1) * matrix(2, 2) - matrix(1, 2)**2
      if (.not. (matrix(1, 1) > 0.0_wp .and. &
                 det > 1.0e-3_wp * (metric(1, 1) * metric(2, 2) - metric(1, 2)**2))) then
        matrix = metric
        det = matrix(1, 1) * matrix(2, 2) - matrix(1, 2)**2
        if (.not. det > 0.0_wp) return
      end if
      step(1) = (matrix(2, 2) * g(1) - matrix(1, 2) * g(2)) / det
      step(2) = (matrix(1, 1) * g(2) - matrix(1, 2) * g(1)) / det
      weight(2:3) = weight(2:3) + step
      weight(1) = 1.0_wp - weight(2) - weight(3)
      if (maxval(abs(step)) <= ROUNDING .or. flat) exit
      if (maxval(abs(weight)) > 3.0_wp) return
    end do
    if (iteration > MAXIMUM_ITERATIONS) return
    if (minval(weight) >= -10.0_wp * ROUNDING) place = PLACE_INSIDE

  end subroutine find_inside

  !> Weights of the point of the plane through three corners nearest to x, moved into the triangle.
  pure function weight_on_plane(corner, x) result(weight)
    real(wp), intent(in) :: corner(3, 3)
    real(wp), intent(in) :: x(3)
    real(wp) :: weight(3)

    real(wp) :: normal(3)

    normal = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
    weight(2) = dot_product(normal, cross_product(x - corner(:, 1), corner(:, 3) - corner(:, 1)))
    weight(3) = dot_product(normal, cross_product(corner(:, 2) - corner(:, 1), x - corner(:, 1)))
    weight(2:3) = weight(2:3) / dot_product(normal, normal)
    weight(1) = 1.0_wp - weight(2) - weight(3)
    weight = max(weight, 0.0_wp)
    weight = weight / sum(weight)

  end function weight_on_plane

  !> The number s in 0 to 1 of the point of a line nearest to x.
  pure subroutine nearest_on_curve(first, last, bend, x, s)
    real(wp), intent(in) :: first(3), last(3), bend(3)
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: s

    integer :: iteration
    real(wp) :: from(3), old, slope, tangent(3)

    tangent = last - first
    s = dot_product(x - first, tangent) / dot_product(tangent, tangent)
    s = min(max(s, 0.0_wp), 1.0_wp)
    if (.not. any(abs(bend) > 0.0_wp)) return
    do iteration = 1, MAXIMUM_ITERATIONS
      from = x - curve_point(first, last, bend, s)
      tangent = last - first - (1.0_wp - 2.0_wp * s) * bend
      slope = dot_product(tangent, tangent)
      if (slope - 2.0_wp * dot_product(from, bend) > 1.0e-3_wp * slope) then
        slope = slope - 2.0_wp * dot_product(from, bend)
      end if
      old = s
      s = min(max(s + dot_product(from, tangent) / slope, 0.0_wp), 1.0_wp)
      if (abs(s - old) <= ROUNDING) exit
    end do

  end subroutine nearest_on_curve

  pure function curve_point(first, last, bend, s) result(x)
    real(wp), intent(in) :: first(3), last(3), bend(3)
    real(wp), intent(in) :: s
    real(wp) :: x(3)

    x = (1.0_wp - s) * first + s * last - s * (1.0_wp - s) * bend

  end function curve_point

  pure function triangle_point(corner, bend, weight) result(x)
    real(wp), intent(in) :: corner(3, 3), bend(3, 3)
    real(wp), intent(in) :: weight(3)
    real(wp) :: x(3)

    integer :: k

    x = 0.0_wp
    do k = 1, 3
      x = x + weight(k) * (corner(:, k) - weight(NEXT(k)) * bend(:, k))
    end do

  end function triangle_point

  !> Derivatives of a triangle by the weights of corners 2 and 3, that of corner 1 making up.
  pure subroutine side_tangents(corner, bend, weight, derivative, second)
    real(wp), intent(in) :: corner(3, 3), bend(3, 3)
    real(wp), intent(in) :: weight(3)
    real(wp), intent(out) :: derivative(3, 2)
    !> By 2 twice, 3 twice, and both.
    real(wp), intent(out) :: second(3, 3)

    derivative(:, 1) = corner(:, 2) - corner(:, 1) - (weight(1) - weight(2)) * bend(:, 1) &
      - weight(3) * (bend(:, 2) - bend(:, 3))
    derivative(:, 2) = corner(:, 3) - corner(:, 1) - (weight(1) - weight(3)) * bend(:, 3) &
      - weight(2) * (bend(:, 2) - bend(:, 1))
    second(:, 1) = 2.0_wp * bend(:, 1)
    second(:, 2) = 2.0_wp * bend(:, 3)
    second(:, 3) = bend(:, 1) - bend(:, 2) + bend(:, 3)

  end subroutine side_tangents

  !> Signed distance from the inside of a triangle, at the foot with given weights: its gradient is
  !> the normal, its second derivative \(-a\,G^{-1} B\,(G - \varphi B)^{-1} a^T\) with the tangents
  !> a, the metric G and the second fundamental form B.
  pure subroutine surface_distance(corner, bend, weight, x, distance, normal, hessian)
    real(wp), intent(in) :: corner(3, 3), bend(3, 3)
    real(wp), intent(in) :: weight(3)
    real(wp), intent(in) :: x(3)
    !> Positive on the side of the normal [length].
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: b(2, 2), derivative(3, 2), g(2, 2), m(2, 2), second(3, 3), shifted(2, 2)

    call side_tangents(corner, bend, weight, derivative, second)
    normal = cross_product(derivative(:, 1), derivative(:, 2))
    normal = normal / norm2(normal)
    distance = dot_product(x - triangle_point(corner, bend, weight), normal)
    g = matmul(transpose(derivative), derivative)
    b(1, 1) = dot_product(normal, second(:, 1))
    b(2, 2) = dot_product(normal, second(:, 2))
    b(1, 2) = dot_product(normal, second(:, 3))
    b(2, 1) = b(1, 2)
    shifted = g - distance * b
    hessian = 0.0_wp
    ! At a centre of curvature there is no derivative
    if (.not. determinant(shifted) > epsilon(1.0_wp) * determinant(g)) return
    m = matmul(inverse(g), b)
    shifted = inverse(shifted)
    m = matmul(m, shifted)
    hessian = -m(1, 1) * dyadic(derivative(:, 1), derivative(:, 1)) &
      - m(2, 2) * dyadic(derivative(:, 2), derivative(:, 2)) &
      - 0.5_wp * (m(1, 2) + m(2, 1)) * (dyadic(derivative(:, 1), derivative(:, 2)) &
                                        + dyadic(derivative(:, 2), derivative(:, 1)))

  end subroutine surface_distance

  pure function determinant(m) result(det)
    real(wp), intent(in) :: m(2, 2)
    real(wp) :: det

    det = m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)

  end function determinant

  pure function inverse(m) result(inverted)
    real(wp), intent(in) :: m(2, 2)
    real(wp) :: inverted(2, 2)

    inverted = reshape([m(2, 2), -m(2, 1), -m(1, 2), m(1, 1)], [2, 2]) / determinant(m)

  end function inverse

  !> Distance from a line in space, at its point s: gradient and second derivative. On the line
  !> itself both are 0.
  pure subroutine curve_distance(first, last, bend, s, x, distance, gradient, hessian)
    real(wp), intent(in) :: first(3), last(3), bend(3)
    real(wp), intent(in) :: s
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: gradient(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: from(3), slope, tangent(3)

    from = x - curve_point(first, last, bend, s)
    call point_distance(from, norm2(last - first), distance, gradient, hessian)
    if (.not. any(abs(hessian) > 0.0_wp)) return
    tangent = last - first - (1.0_wp - 2.0_wp * s) * bend
    slope = dot_product(tangent, tangent) - 2.0_wp * dot_product(from, bend)
    if (slope > epsilon(1.0_wp) * dot_product(tangent, tangent)) then
      hessian = hessian - dyadic(tangent, tangent) / (slope * distance)
    end if

  end subroutine curve_distance

  !> Distance from a point: gradient and second derivative, 0 at the point itself.
  pure subroutine point_distance(from, scale, distance, gradient, hessian)
    !> From the point to x [length].
    real(wp), intent(in) :: from(3)
    !> A length of the size of the facets [length].
    real(wp), intent(in) :: scale
    real(wp), intent(out) :: distance
    real(wp), intent(out) :: gradient(3)
    real(wp), intent(out) :: hessian(3, 3)

    distance = norm2(from)
    gradient = 0.0_wp
    hessian = 0.0_wp
    if (distance <= 1.0e-14_wp * scale) return
    gradient = from / distance
    hessian = (IDENTITY - dyadic(gradient, gradient)) / distance

  end subroutine point_distance

end module swage_facet
