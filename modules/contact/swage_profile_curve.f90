!> Plane curves of straight pieces and arcs that divide their plane into tool and material.
module swage_profile_curve
  use swage_kinds, only: wp
  use swage_text, only: near, text
  implicit none(type, external)
  private

  public :: profile_curve_t, profile_curve_create

  !> Lengths below this share of the size of the curve are taken for zero.
  real(wp), parameter :: TOLERANCE = 1.0e-10_wp
  !> Rounding of a coordinate, as a share of the size of the curve: ranges of neighbouring pieces
  !> overlap by this much, so that no point falls between them.
  real(wp), parameter :: SLACK = 1.0e-14_wp
  !> Length that counts as endless; twice of it is still a number.
  real(wp), parameter :: FAR = 0.25_wp * huge(1.0_wp)
  !> Cosine of the turn at a corner below which the curve folds back on itself.
  real(wp), parameter :: FOLD = -1.0_wp + 1.0e-8_wp

  !> A straight piece or an arc of less than half a turn.
  type :: piece_t
    logical :: is_arc = .false.
    !> Straight: its origin, from which `low` and `high` count.
    real(wp) :: origin(2) = 0.0_wp
    real(wp) :: tangent(2) = 0.0_wp
    !> Out of the tool.
    real(wp) :: normal(2) = 0.0_wp
    !> Range of the coordinate along the tangent [length]; `FAR` where it has no end.
    real(wp) :: low = 0.0_wp
    real(wp) :: high = 0.0_wp
    !> True where the piece ends in a sharp corner, and the sum of both normals there.
    logical :: sharp_low = .false.
    logical :: sharp_high = .false.
    real(wp) :: normal_low(2) = 0.0_wp
    real(wp) :: normal_high(2) = 0.0_wp
    !> Arc: centre, radius, unit vectors from the centre to both ends in counterclockwise order.
    real(wp) :: centre(2) = 0.0_wp
    real(wp) :: radius = 0.0_wp
    real(wp) :: first(2) = 0.0_wp
    real(wp) :: last(2) = 0.0_wp
    !> 1: the centre is on the side of the material; -1: on that of the tool.
    real(wp) :: side = 1.0_wp
  end type piece_t

  !> A curve without ends: closed, or prolonged straight for ever, or ending on the axis about
  !> which it is revolved. Immutable once created.
  type :: profile_curve_t
    private
    type(piece_t), allocatable :: pieces(:)
    !> The polygon with its fillets as points, for pictures [length]; shape (2, :).
    real(wp), allocatable :: outline(:, :)
    !> True where the first or last straight piece has no end, and where it goes; shape (2, 2).
    logical :: prolonged(2) = .false.
    real(wp) :: away(2, 2) = 0.0_wp
    !> Largest coordinate and extent [length].
    real(wp) :: size = 0.0_wp
  contains
    !> Signed distance of a point with its derivatives.
    procedure, public :: project => profile_curve_project
    !> The curve as a polygon; straight ends are prolonged to a given length.
    procedure, public :: get_outline => profile_curve_get_outline
  end type profile_curve_t

  !> The polygon before its corners are rounded.
  type :: chain_t
    integer :: n = 0
    !> Shape (2, n).
    real(wp), allocatable :: x(:, :)
    !> Radius of the fillet at each point, and length that it cuts off its segments; shape (n).
    real(wp), allocatable :: radius(:)
    real(wp), allocatable :: cut(:)
    !> Direction and length of the segment that begins at each point; shape (2, n), (n).
    real(wp), allocatable :: tangent(:, :)
    real(wp), allocatable :: length(:)
    integer :: n_segment = 0
    logical :: closed = .false.
    !> True when the first or last segment has no end.
    logical :: prolonged(2) = .false.
  end type chain_t

contains

  !> Make a curve from the corners of a polygon. On failure `curve` must not be used.
  pure subroutine profile_curve_create(points, fillets, closed, material_left, around_axis, curve, &
                                       key, why)
    !> [length]; shape (2, n).
    real(wp), intent(in) :: points(:, :)
    !> Radii of the arcs at the corners [length], at least 0: one for each point, one for all
    !> corners, or none. Ends that are no corners must have 0, unless one radius stands for all.
    real(wp), intent(in) :: fillets(:)
    !> True when a segment leads from the last point to the first.
    logical, intent(in) :: closed
    !> True when the material is to the left of the way from the first to the last point.
    logical, intent(in) :: material_left
    !> True when the first coordinate is a distance from an axis of revolution. The curve and its
    !> prolongations then end on the axis; a fillet there belongs to the cone of the first segment.
    logical, intent(in) :: around_axis
    type(profile_curve_t), intent(out) :: curve
    !> What is wrong: `points` or `fillets`, and a message; empty when nothing is.
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: why

    real(wp) :: scale
    type(chain_t) :: chain

    key = 'points'
    why = ''
    if (size(points, 2) < merge(3, 2, closed)) then
      why = 'must be at least '//text(merge(3, 2, closed))//' points'
      return
    end if
    scale = max(maxval(points(1, :)) - minval(points(1, :)), &
                maxval(points(2, :)) - minval(points(2, :)))
    why = fault_of_points(points, closed, around_axis, scale)
    if (why /= '') return

    key = 'fillets'
    call start_chain(points, fillets, closed, around_axis, TOLERANCE * scale, chain, why)
    if (why /= '') return
    key = 'points'
    if (around_axis .and. .not. closed) call end_on_axis(chain, scale)
    call measure_chain(chain)
    why = fault_of_chain(chain)
    if (why /= '') return
    key = 'fillets'
    why = fault_of_fillets(chain)
    if (why /= '') return

    curve%size = max(scale, maxval(abs(points)))
    curve%prolonged = chain%prolonged
    curve%away(:, 1) = -chain%tangent(:, 1)
    curve%away(:, 2) = chain%tangent(:, chain%n_segment)
    if (around_axis .and. .not. closed) call mirror_at_axis(chain)
    call make_outline(chain, curve)
    if (around_axis) call leave_mirror_image_out(curve%outline, TOLERANCE * scale)
    call make_pieces(chain, material_left, TOLERANCE * scale, curve%pieces)

  end subroutine profile_curve_create

  !> What is wrong with single points; empty when nothing is.
  pure function fault_of_points(points, closed, around_axis, scale) result(why)
    real(wp), intent(in) :: points(:, :)
    logical, intent(in) :: closed
    logical, intent(in) :: around_axis
    real(wp), intent(in) :: scale
    character(len=:), allocatable :: why

    integer :: i, n, next

    why = ''
    n = size(points, 2)
    do i = 1, merge(n, n - 1, closed)
      next = 1 + mod(i, n)
      if (norm2(points(:, next) - points(:, i)) > TOLERANCE * scale) cycle
      why = 'point '//text(next)//' is the same as point '//text(i)
      return
    end do
    if (.not. around_axis) return
    do i = 1, n
      if (points(1, i) < -TOLERANCE * scale) then
        why = 'point '//text(i)//' is at the radius '//text(points(1, i))//', which must be at '// &
          'least 0: the first coordinate is the distance from the axis of revolution'
      else if (points(1, i) <= TOLERANCE * scale .and. (closed .or. (i > 1 .and. i < n))) then
        why = 'point '//text(i)//' is on the axis of revolution: only the first and the last '// &
          'point of a profile that is not closed may be there'
      end if
      if (why /= '') return
    end do

  end function fault_of_points

  !> The points with the fillets as given.
  pure subroutine start_chain(points, fillets, closed, around_axis, nothing, chain, why)
    real(wp), intent(in) :: points(:, :)
    real(wp), intent(in) :: fillets(:)
    logical, intent(in) :: closed
    logical, intent(in) :: around_axis
    !> A radius that counts as 0 [length].
    real(wp), intent(in) :: nothing
    type(chain_t), intent(out) :: chain
    character(len=:), allocatable, intent(out) :: why

    integer :: i

    why = ''
    chain%n = size(points, 2)
    chain%closed = closed
    chain%prolonged = .not. closed
    allocate (chain%x, source=points)
    allocate (chain%radius(chain%n), source=0.0_wp)
    if (size(fillets) == chain%n) then
      chain%radius = fillets
    else if (size(fillets) == 1) then
      chain%radius = fillets(1)
    else if (size(fillets) > 0) then
      why = 'must be one radius for each of the '//text(chain%n)//' points, or one for all '// &
        'corners; given: '//text(size(fillets))
      return
    end if
    if (closed) return
    do i = 1, chain%n, chain%n - 1
      if (around_axis .and. points(1, i) <= nothing) cycle
      if (size(fillets) > 1 .and. chain%radius(i) > 0.0_wp) then
        why = 'the end'//near(points(:, i))//' is no corner: its radius must be 0'
        return
      end if
      chain%radius(i) = 0.0_wp
    end do

  end subroutine start_chain

  !> Let the ends of a curve around an axis end there: those that are on it, and those whose
  !> prolongation meets it.
  pure subroutine end_on_axis(chain, scale)
    type(chain_t), intent(inout) :: chain
    real(wp), intent(in) :: scale

    integer :: end, inner, place
    real(wp) :: away(2), x(2)

    do end = 1, 2
      place = merge(1, chain%n, end == 1)
      inner = merge(2, chain%n - 1, end == 1)
      x = chain%x(:, place)
      if (x(1) <= TOLERANCE * scale) then
        chain%x(1, place) = 0.0_wp
        chain%prolonged(end) = .false.
        cycle
      end if
      away = x - chain%x(:, inner)
      away = away / norm2(away)
      if (away(1) > -TOLERANCE) cycle
      call insert_point(chain, merge(1, chain%n + 1, end == 1), &
                        [0.0_wp, x(2) - away(2) * x(1) / away(1)])
      chain%prolonged(end) = .false.
    end do

  end subroutine end_on_axis

  !> Add a point without fillet.
  pure subroutine insert_point(chain, place, x)
    type(chain_t), intent(inout) :: chain
    !> Of the new point.
    integer, intent(in) :: place
    real(wp), intent(in) :: x(2)

    real(wp), allocatable :: longer(:, :), radius(:)

    allocate (longer(2, chain%n + 1), radius(chain%n + 1))
    longer(:, :place - 1) = chain%x(:, :place - 1)
    longer(:, place) = x
    longer(:, place + 1:) = chain%x(:, place:)
    radius(:place - 1) = chain%radius(:place - 1)
    radius(place) = 0.0_wp
    radius(place + 1:) = chain%radius(place:)
    chain%n = chain%n + 1
    call move_alloc(longer, chain%x)
    call move_alloc(radius, chain%radius)

  end subroutine insert_point

  !> Directions and lengths of the segments, and what the fillets cut off them.
  pure subroutine measure_chain(chain)
    type(chain_t), intent(inout) :: chain

    integer :: i, previous
    real(wp) :: cosine, sine

    chain%n_segment = merge(chain%n, chain%n - 1, chain%closed)
    if (allocated(chain%tangent)) deallocate (chain%tangent, chain%length, chain%cut)
    allocate (chain%tangent(2, chain%n_segment), chain%length(chain%n_segment))
    allocate (chain%cut(chain%n), source=0.0_wp)
    do i = 1, chain%n_segment
      chain%tangent(:, i) = chain%x(:, 1 + mod(i, chain%n)) - chain%x(:, i)
      chain%length(i) = norm2(chain%tangent(:, i))
      chain%tangent(:, i) = chain%tangent(:, i) / chain%length(i)
    end do
    do i = 1, chain%n
      call turn_at(chain, i, previous, cosine, sine)
      if (previous == 0) cycle
      ! Half the tangent of the turn
      if (cosine > FOLD) chain%cut(i) = chain%radius(i) * abs(sine) / (1.0_wp + cosine)
    end do

  end subroutine measure_chain

  !> How the curve turns at a point.
  pure subroutine turn_at(chain, i, previous, cosine, sine)
    type(chain_t), intent(in) :: chain
    integer, intent(in) :: i
    !> The segment that ends there; 0 when the point is an end.
    integer, intent(out) :: previous
    !> Of the turn; positive to the left.
    real(wp), intent(out) :: cosine, sine

    cosine = 1.0_wp
    sine = 0.0_wp
    previous = i - 1
    if (chain%closed .and. i == 1) previous = chain%n_segment
    if (.not. chain%closed .and. i == chain%n) previous = 0
    if (previous == 0) return
    associate (a => chain%tangent(:, previous), b => chain%tangent(:, i))
      cosine = dot_product(a, b)
      sine = a(1) * b(2) - a(2) * b(1)
    end associate

  end subroutine turn_at

  !> What is wrong with the polygon; empty when nothing is.
  pure function fault_of_chain(chain) result(why)
    type(chain_t), intent(in) :: chain
    character(len=:), allocatable :: why

    integer :: i, j, previous
    real(wp) :: cosine, sine

    why = ''
    do i = 1, chain%n
      call turn_at(chain, i, previous, cosine, sine)
      if (previous == 0 .or. cosine > FOLD) cycle
      why = 'the profile folds back on itself'//near(chain%x(:, i))
      return
    end do
    do i = 1, chain%n_segment
      do j = i + 2, chain%n_segment
        if (chain%closed .and. i == 1 .and. j == chain%n_segment) cycle
        if (.not. segments_meet(chain, i, j)) cycle
        why = 'the profile must not cross itself: the segment that starts'//near(chain%x(:, i))// &
          ' meets the one that starts'//near(chain%x(:, j))
        if (any(chain%prolonged)) why = why//'; the first and last segment have no end'
        return
      end do
    end do

  end function fault_of_chain

  !> True when two segments that are no neighbours have a point in common.
  pure function segments_meet(chain, i, j) result(meet)
    type(chain_t), intent(in) :: chain
    integer, intent(in) :: i
    integer, intent(in) :: j
    logical :: meet

    real(wp) :: apart(2), cross, range_i(2), range_j(2), s(2)

    range_i = range_of(i)
    range_j = range_of(j)
    apart = chain%x(:, j) - chain%x(:, i)
    associate (a => chain%tangent(:, i), b => chain%tangent(:, j))
      cross = a(1) * b(2) - a(2) * b(1)
      if (abs(cross) > TOLERANCE) then
        s(1) = (apart(1) * b(2) - apart(2) * b(1)) / cross
        s(2) = (apart(1) * a(2) - apart(2) * a(1)) / cross
        meet = s(1) >= range_i(1) .and. s(1) <= range_i(2) .and. &
          s(2) >= range_j(1) .and. s(2) <= range_j(2)
      else
        ! Parallel: the same line, with ranges that overlap
        meet = abs(apart(1) * a(2) - apart(2) * a(1)) <= TOLERANCE * chain%length(i)
        if (.not. meet) return
        s(1) = dot_product(apart, a)
        if (dot_product(a, b) < 0.0_wp) range_j = [-range_j(2), -range_j(1)]
        meet = s(1) + range_j(1) <= range_i(2) .and. s(1) + range_j(2) >= range_i(1)
      end if
    end associate

  contains

    pure function range_of(segment) result(range)
      integer, intent(in) :: segment
      real(wp) :: range(2)

      range = [-TOLERANCE, 1.0_wp + TOLERANCE] * chain%length(segment)
      if (segment == 1 .and. chain%prolonged(1)) range(1) = -FAR
      if (segment == chain%n_segment .and. chain%prolonged(2)) range(2) = FAR

    end function range_of

  end function segments_meet

  !> What is wrong with the fillets; empty when nothing is.
  pure function fault_of_fillets(chain) result(why)
    type(chain_t), intent(in) :: chain
    character(len=:), allocatable :: why

    integer :: i, j, next
    real(wp) :: used

    why = ''
    do i = 1, chain%n_segment
      if (i == 1 .and. chain%prolonged(1)) cycle
      if (i == chain%n_segment .and. chain%prolonged(2)) cycle
      next = 1 + mod(i, chain%n)
      used = used_at(i) + used_at(next)
      if (used <= chain%length(i) * (1.0_wp + TOLERANCE)) cycle
      why = 'the arcs on the segment that starts'//near(chain%x(:, i))//' need '//text(used)// &
        ' of its length '//text(chain%length(i))//' [length]'
      return
    end do
    do i = 1, chain%n
      if (.not. chain%cut(i) > 0.0_wp) cycle
      do j = 1, chain%n
        if (j == i .or. .not. is_cut_off(chain, i, chain%x(:, j))) cycle
        why = 'the arc that rounds the corner'//near(chain%x(:, i))//' runs over the point'// &
          near(chain%x(:, j))
        return
      end do
    end do

  contains

    !> Length of a segment that the arc at one of its ends needs. At an end on the axis the arc
    !> is half of that between the segment and its mirror image.
    pure function used_at(i) result(used)
      integer, intent(in) :: i
      real(wp) :: used

      used = chain%cut(i)
      if (chain%closed) return
      if (i == 1) used = chain%radius(i) * tip_slope(chain%tangent(:, 1))
      if (i == chain%n) used = chain%radius(i) * tip_slope(-chain%tangent(:, chain%n_segment))

    end function used_at

    !> Cotangent of the angle between the axis and a segment that leaves it.
    pure function tip_slope(tangent) result(slope)
      real(wp), intent(in) :: tangent(2)
      real(wp) :: slope

      slope = abs(tangent(2)) / tangent(1)

    end function tip_slope

  end function fault_of_fillets

  !> True when a point is in the triangle that the fillet of a corner cuts off.
  pure function is_cut_off(chain, i, x) result(inside)
    type(chain_t), intent(in) :: chain
    integer, intent(in) :: i
    real(wp), intent(in) :: x(2)
    logical :: inside

    real(wp) :: a(2), b(2), cross, s(2)
    integer :: previous
    real(wp) :: cosine, sine

    inside = .false.
    call turn_at(chain, i, previous, cosine, sine)
    if (previous == 0) return
    a = -chain%tangent(:, previous)
    b = chain%tangent(:, i)
    cross = a(1) * b(2) - a(2) * b(1)
    if (.not. abs(cross) > TOLERANCE) return
    associate (w => x - chain%x(:, i))
      s(1) = (w(1) * b(2) - w(2) * b(1)) / cross
      s(2) = (a(1) * w(2) - a(2) * w(1)) / cross
    end associate
    inside = all(s > 0.0_wp) .and. sum(s) < chain%cut(i)

  end function is_cut_off

  !> Put the mirror image of the neighbour before an end on the axis: the tip is then a corner as
  !> any other, and in the half plane of the curve the image is never nearer than the curve.
  pure subroutine mirror_at_axis(chain)
    type(chain_t), intent(inout) :: chain

    logical :: first, last

    first = .not. chain%prolonged(1)
    last = .not. chain%prolonged(2)
    if (first) call insert_point(chain, 1, [-chain%x(1, 2), chain%x(2, 2)])
    if (last) then
      call insert_point(chain, chain%n + 1, [-chain%x(1, chain%n - 1), chain%x(2, chain%n - 1)])
    end if
    call measure_chain(chain)

  end subroutine mirror_at_axis

  !> Straight pieces and arcs of a polygon.
  pure subroutine make_pieces(chain, material_left, smallest, pieces)
    type(chain_t), intent(in) :: chain
    logical, intent(in) :: material_left
    !> Shorter pieces are left out [length].
    real(wp), intent(in) :: smallest
    type(piece_t), allocatable, intent(out) :: pieces(:)

    integer :: i, n
    real(wp) :: left
    type(piece_t) :: list(2 * chain%n)

    left = merge(1.0_wp, -1.0_wp, material_left)
    n = 0
    do i = 1, chain%n_segment
      if (chain%cut(i) > smallest) then
        n = n + 1
        call make_arc(chain, i, left, list(n))
      end if
      n = n + 1
      call make_straight(chain, i, left, smallest, list(n))
      if (list(n)%high - list(n)%low <= smallest) n = n - 1
    end do
    allocate (pieces, source=list(:n))

  end subroutine make_pieces

  !> What the corners leave of a segment.
  pure subroutine make_straight(chain, i, left, smallest, piece)
    type(chain_t), intent(in) :: chain
    !> The segment.
    integer, intent(in) :: i
    !> 1: the material is on the left; -1: on the right.
    real(wp), intent(in) :: left
    !> An arc that cuts off less is a sharp corner [length].
    real(wp), intent(in) :: smallest
    type(piece_t), intent(out) :: piece

    integer :: next, previous
    real(wp) :: cosine, sine

    next = 1 + mod(i, chain%n)
    piece%origin = chain%x(:, i)
    piece%tangent = chain%tangent(:, i)
    piece%normal = left * turned(chain%tangent(:, i))
    call turn_at(chain, i, previous, cosine, sine)
    if (chain%cut(i) > smallest) then
      piece%low = chain%cut(i)
    else if (previous > 0) then
      piece%sharp_low = .true.
      piece%normal_low = left * turned(chain%tangent(:, previous)) + piece%normal
    end if
    call turn_at(chain, next, previous, cosine, sine)
    piece%high = chain%length(i)
    if (chain%cut(next) > smallest) then
      piece%high = chain%length(i) - chain%cut(next)
    else if (previous > 0) then
      piece%sharp_high = .true.
      piece%normal_high = piece%normal + left * turned(chain%tangent(:, next))
    end if
    if (i == 1 .and. chain%prolonged(1)) piece%low = -FAR
    if (i == chain%n_segment .and. chain%prolonged(2)) piece%high = FAR

  end subroutine make_straight

  !> The arc at a corner.
  pure subroutine make_arc(chain, i, left, piece)
    type(chain_t), intent(in) :: chain
    !> The corner.
    integer, intent(in) :: i
    !> As `make_straight`.
    real(wp), intent(in) :: left
    type(piece_t), intent(out) :: piece

    integer :: previous
    real(wp) :: arrive(2), cosine, leave(2), sine

    call turn_at(chain, i, previous, cosine, sine)
    arrive = chain%x(:, i) - chain%cut(i) * chain%tangent(:, previous)
    leave = chain%x(:, i) + chain%cut(i) * chain%tangent(:, i)
    piece%is_arc = .true.
    piece%radius = chain%radius(i)
    piece%centre = arrive + sign(piece%radius, sine) * turned(chain%tangent(:, previous))
    piece%side = sign(left, left * sine)
    piece%first = (merge(arrive, leave, sine > 0.0_wp) - piece%centre) / piece%radius
    piece%last = (merge(leave, arrive, sine > 0.0_wp) - piece%centre) / piece%radius

  end subroutine make_arc

  !> A vector turned to the left by a right angle.
  pure function turned(vector) result(left)
    real(wp), intent(in) :: vector(2)
    real(wp) :: left(2)

    left = [-vector(2), vector(1)]

  end function turned

  !> The polygon of the outline: arcs become chords.
  pure subroutine make_outline(chain, curve)
    type(chain_t), intent(in) :: chain
    type(profile_curve_t), intent(inout) :: curve

    !> Chords of a quarter turn.
    integer, parameter :: N_CHORD = 12
    real(wp), parameter :: QUARTER = 0.5_wp * acos(-1.0_wp)

    integer :: i, j, n, n_step, previous
    real(wp) :: angle, arrive(2), centre(2), cosine, from_centre(2), sine
    real(wp) :: x(2, chain%n * (2 * N_CHORD + 3) + 1)

    n = 0
    do i = 1, chain%n
      call turn_at(chain, i, previous, cosine, sine)
      if (previous == 0 .or. .not. chain%cut(i) > 0.0_wp) then
        n = n + 1
        x(:, n) = chain%x(:, i)
        cycle
      end if
      angle = atan2(sine, cosine)
      ! Even, so that the tip of a curve around an axis is a point
      n_step = 2 * max(1, ceiling(0.5_wp * N_CHORD * abs(angle) / QUARTER))
      arrive = chain%x(:, i) - chain%cut(i) * chain%tangent(:, previous)
      centre = arrive + sign(chain%radius(i), sine) * turned(chain%tangent(:, previous))
      from_centre = arrive - centre
      do j = 0, n_step
        n = n + 1
        cosine = cos(j * angle / n_step)
        sine = sin(j * angle / n_step)
        x(:, n) = centre + [cosine * from_centre(1) - sine * from_centre(2), &
                            sine * from_centre(1) + cosine * from_centre(2)]
      end do
    end do
    if (chain%closed) then
      n = n + 1
      x(:, n) = x(:, 1)
    end if
    allocate (curve%outline, source=x(:, :n))

  end subroutine make_outline

  !> Drop the points before the axis.
  pure subroutine leave_mirror_image_out(outline, nothing)
    real(wp), allocatable, intent(inout) :: outline(:, :)
    !> A radius that counts as 0 [length].
    real(wp), intent(in) :: nothing

    integer :: i, n

    n = 0
    do i = 1, size(outline, 2)
      if (outline(1, i) < -nothing) cycle
      n = n + 1
      outline(:, n) = outline(:, i)
    end do
    outline = outline(:, :n)
    outline(1, :) = max(outline(1, :), 0.0_wp)

  end subroutine leave_mirror_image_out

  !> Penetration of a point: its gradient is -`normal`, its second derivative `hessian`.
  pure subroutine profile_curve_project(self, x, penetration, normal, hessian)
    class(profile_curve_t), intent(in) :: self
    real(wp), intent(in) :: x(2)
    !> [length], positive on the side of the tool.
    real(wp), intent(out) :: penetration
    !> Unit vector out of the tool.
    real(wp), intent(out) :: normal(2)
    !> [1/length]
    real(wp), intent(out) :: hessian(2, 2)

    integer :: i
    real(wp) :: along

    penetration = huge(1.0_wp)
    normal = [1.0_wp, 0.0_wp]
    hessian = 0.0_wp
    do i = 1, size(self%pieces)
      associate (piece => self%pieces(i))
        if (piece%is_arc) then
          call try_arc(piece, x, penetration, normal, hessian)
          cycle
        end if
        along = dot_product(x - piece%origin, piece%tangent)
        if (along < piece%low - SLACK * self%size) then
          if (piece%sharp_low) then
            call try_corner(x - piece%origin, piece%normal_low, SLACK * self%size, &
                            penetration, normal, hessian)
          end if
        else if (along > piece%high + SLACK * self%size) then
          if (piece%sharp_high) then
            call try_corner(x - piece%origin - piece%high * piece%tangent, piece%normal_high, &
                            SLACK * self%size, penetration, normal, hessian)
          end if
        else
          along = -dot_product(x - piece%origin, piece%normal)
          if (abs(along) < abs(penetration)) then
            penetration = along
            normal = piece%normal
            hessian = 0.0_wp
          end if
        end if
      end associate
    end do

  end subroutine profile_curve_project

  !> Take a sharp corner when it is nearer than what has been found.
  pure subroutine try_corner(from, sum_of_normals, nothing, penetration, normal, hessian)
    !> From the corner to the point [length].
    real(wp), intent(in) :: from(2)
    !> Of the normals of both pieces: the side to which it points is outside.
    real(wp), intent(in) :: sum_of_normals(2)
    !> A distance that counts as 0 [length].
    real(wp), intent(in) :: nothing
    real(wp), intent(inout) :: penetration
    real(wp), intent(inout) :: normal(2)
    real(wp), intent(inout) :: hessian(2, 2)

    real(wp) :: distance, outside

    distance = norm2(from)
    if (distance >= abs(penetration)) return
    outside = sign(1.0_wp, dot_product(from, sum_of_normals))
    penetration = -outside * distance
    if (distance > nothing) then
      normal = outside * from / distance
      hessian(1, 1) = -outside / distance * normal(2)**2
      hessian(2, 2) = -outside / distance * normal(1)**2
      hessian(1, 2) = outside / distance * normal(1) * normal(2)
      hessian(2, 1) = hessian(1, 2)
    else
      normal = sum_of_normals / norm2(sum_of_normals)
      hessian = 0.0_wp
    end if

  end subroutine try_corner

  !> Take an arc when it is nearer than what has been found.
  pure subroutine try_arc(piece, x, penetration, normal, hessian)
    type(piece_t), intent(in) :: piece
    real(wp), intent(in) :: x(2)
    real(wp), intent(inout) :: penetration
    real(wp), intent(inout) :: normal(2)
    real(wp), intent(inout) :: hessian(2, 2)

    real(wp) :: direction(2), distance

    direction = x - piece%centre
    distance = norm2(direction)
    if (abs(distance - piece%radius) >= abs(penetration)) return
    if (distance > SLACK * piece%radius) then
      direction = direction / distance
      if (piece%first(1) * direction(2) - piece%first(2) * direction(1) < -SLACK) return
      if (direction(1) * piece%last(2) - direction(2) * piece%last(1) < -SLACK) return
      hessian(1, 1) = piece%side / distance * direction(2)**2
      hessian(2, 2) = piece%side / distance * direction(1)**2
      hessian(1, 2) = -piece%side / distance * direction(1) * direction(2)
      hessian(2, 1) = hessian(1, 2)
    else
      direction = piece%first
      hessian = 0.0_wp
    end if
    penetration = piece%side * (distance - piece%radius)
    normal = -piece%side * direction

  end subroutine try_arc

  pure subroutine profile_curve_get_outline(self, length, outline)
    class(profile_curve_t), intent(in) :: self
    !> Of the straight ends at least [length].
    real(wp), intent(in) :: length
    !> Shape (2, :).
    real(wp), allocatable, intent(out) :: outline(:, :)

    integer :: n

    allocate (outline, source=self%outline)
    n = size(outline, 2)
    if (self%prolonged(1)) then
      outline(:, 1) = outline(:, 2) + self%away(:, 1) &
        * max(length, dot_product(outline(:, 1) - outline(:, 2), self%away(:, 1)))
    end if
    if (self%prolonged(2)) then
      outline(:, n) = outline(:, n - 1) + self%away(:, 2) &
        * max(length, dot_product(outline(:, n) - outline(:, n - 1), self%away(:, 2)))
    end if

  end subroutine profile_curve_get_outline

end module swage_profile_curve
