!> Surfaces of triangles in space, and of lines in a plane: who is whose neighbour, which side is
!> out, is it closed.
module swage_surface
  use swage_bounding_tree, only: bounding_tree_create, bounding_tree_t
  use swage_kinds, only: gp, wp
  use swage_rotation, only: cross_product
  use swage_sort, only: sorting_order
  use swage_status, only: status_t, EXIT_MESH, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: surface_t, surface_create

  !> Corners nearer to each other than this share of the size of the surface are one.
  real(wp), parameter :: MERGING = 1.0e-6_wp
  !> A facet whose height is below this share of its longest side is a needle without a normal.
  real(wp), parameter :: NEEDLE = 1.0e-6_wp

  !> Facets are triangles, counterclockwise when seen from outside, or lines that have the outside
  !> on their right. Side k of a triangle goes from corner k to the next; side k of a line is its
  !> corner k.
  type :: surface_t
    !> Corners of a facet: 2 or 3.
    integer :: n_corner = 0
    integer :: n_vertex = 0
    integer :: n_facet = 0
    !> Positions [length]; shape (3, n_vertex).
    real(wp), allocatable :: x(:, :)
    !> Vertices of each facet; shape (n_corner, n_facet).
    integer, allocatable :: vertex(:, :)
    !> Number in the file; shape (n_facet).
    integer, allocatable :: label(:)
    !> The facet beyond each side, 0 none, and which of its sides that is; shape as `vertex`.
    integer, allocatable :: neighbour(:, :)
    integer, allocatable :: neighbour_side(:, :)
    !> Unit normals, 0 for a needle; shape (3, n_facet).
    real(wp), allocatable :: normal(:, :)
    !> True when every side has a neighbour.
    logical :: closed = .false.
    !> Enclosed volume [length^3], in a plane area [length^2]; positive when out is outwards.
    real(wp) :: volume = 0.0_wp
    !> Diagonal of the box around it [length].
    real(wp) :: size = 0.0_wp
    !> Facets given that have fewer than three (two) different corners, and were left out.
    integer :: n_dropped = 0
    !> Facets that were turned.
    integer :: n_turned = 0
  end type surface_t

contains

  !> Make a surface of facets, each with the positions of its own corners.
  !>
  !> On failure `surface` must not be used.
  pure subroutine surface_create(name, corners, label, reorient, surface, status)
    !> What to call it in messages: the path of a file.
    character(len=*), intent(in) :: name
    !> [length]; shape (3, n_corner, n_facet).
    real(wp), intent(in) :: corners(:, :, :)
    !> Number of each facet in the file.
    integer, intent(in) :: label(:)
    !> True: turn facets so that neighbours agree, and each closed part so that out is outwards.
    logical, intent(in) :: reorient
    type(surface_t), intent(out) :: surface
    !> `STATUS_ERROR`, with the number of a facet, when there is no facet, more than two facets meet
    !> at a side, neighbours disagree about the outside, or closed parts do.
    type(status_t), intent(inout) :: status

    integer, allocatable :: part(:)

    surface%n_corner = size(corners, 2)
    call merge_corners(corners, label, surface)
    if (surface%n_facet == 0) then
      call status%raise(STATUS_ERROR, 'surface_create', name//' has no facet with an area', &
                        EXIT_MESH)
      return
    end if
    call find_neighbours(name, surface, status)
    if (status%failed()) return
    call orient(name, reorient, surface, part, status)
    if (status%failed()) return
    surface%closed = all(surface%neighbour > 0)
    call measure_parts(name, reorient, part, surface, status)
    call find_normals(surface)

  end subroutine surface_create

  !> One vertex for corners at the same place; facets that lose a corner are dropped.
  pure subroutine merge_corners(corners, label, surface)
    real(wp), intent(in) :: corners(:, :, :)
    integer, intent(in) :: label(:)
    type(surface_t), intent(inout) :: surface

    integer :: facet, i, j, k, n, n_given
    integer, allocatable :: near(:), new_number(:), same(:)
    real(wp) :: tolerance
    real(wp), allocatable :: x(:, :)
    type(bounding_tree_t) :: tree

    n = surface%n_corner
    n_given = n * size(label)
    allocate (x, source=reshape(corners, [3, n_given]))
    if (n_given > 0) surface%size = norm2(maxval(x, dim=2) - minval(x, dim=2))
    tolerance = MERGING * surface%size

    ! The first corner of those at one place stands for all
    call bounding_tree_create(x, x, tree)
    allocate (same(n_given), source=0)
    do i = 1, n_given
      if (same(i) > 0) cycle
      call tree%candidates(x(:, i) - tolerance, x(:, i) + tolerance, near)
      do j = 1, size(near)
        if (same(near(j)) == 0) same(near(j)) = i
      end do
    end do

    allocate (surface%vertex(n, size(label)), surface%label(size(label)))
    do facet = 1, size(label)
      k = surface%n_facet + 1
      surface%vertex(:, k) = same(n * (facet - 1) + 1:n * facet)
      if (any(surface%vertex(:, k) == cshift(surface%vertex(:, k), 1))) then
        surface%n_dropped = surface%n_dropped + 1
        cycle
      end if
      surface%label(k) = label(facet)
      surface%n_facet = k
    end do
    surface%vertex = surface%vertex(:, :surface%n_facet)
    surface%label = surface%label(:surface%n_facet)

    ! Number the vertices in the order in which facets name them
    allocate (new_number(n_given), source=0)
    do facet = 1, surface%n_facet
      do k = 1, n
        associate (vertex => surface%vertex(k, facet))
          if (new_number(vertex) == 0) then
            surface%n_vertex = surface%n_vertex + 1
            new_number(vertex) = surface%n_vertex
          end if
        end associate
      end do
    end do
    allocate (surface%x(3, surface%n_vertex))
    do i = 1, n_given
      if (new_number(i) > 0) surface%x(:, new_number(i)) = x(:, i)
    end do
    do facet = 1, surface%n_facet
      surface%vertex(:, facet) = new_number(surface%vertex(:, facet))
    end do

  end subroutine merge_corners

  !> Pair the sides of the facets.
  pure subroutine find_neighbours(name, surface, status)
    character(len=*), intent(in) :: name
    type(surface_t), intent(inout) :: surface
    type(status_t), intent(inout) :: status

    integer :: facet, first, i, last, n, n_side, side
    integer, allocatable :: order(:)
    integer(gp), allocatable :: key(:)

    n = surface%n_corner
    n_side = n * surface%n_facet
    allocate (surface%neighbour(n, surface%n_facet), surface%neighbour_side(n, surface%n_facet), &
              source=0)
    allocate (key(n_side))
    do i = 1, n_side
      facet = 1 + (i - 1) / n
      side = 1 + mod(i - 1, n)
      associate (vertex => surface%vertex(:, facet))
        key(i) = vertex(side)
        if (n == 3) then
          key(i) = min(vertex(side), vertex(1 + mod(side, 3)))
          key(i) = key(i) * surface%n_vertex + max(vertex(side), vertex(1 + mod(side, 3)))
        end if
      end associate
    end do
    allocate (order, source=sorting_order(key))
    first = 1
    do while (first <= n_side)
      last = first
      do while (last < n_side)
        if (key(order(last + 1)) /= key(order(first))) exit
        last = last + 1
      end do
      if (last - first == 1) then
        call pair(surface, order(first), order(last))
        call pair(surface, order(last), order(first))
      else if (last - first > 1) then
        call status%raise(STATUS_ERROR, 'surface_create', name//': facet '// &
                          text(label_of(order(first)))//' meets the facets '// &
                          text(label_of(order(first + 1)))//' and '// &
                          text(label_of(order(first + 2)))//' at one side: a surface has two '// &
                          'facets there', EXIT_MESH)
        return
      end if
      first = last + 1
    end do

  contains

    pure function label_of(one) result(label)
      integer, intent(in) :: one
      integer :: label

      label = surface%label(1 + (one - 1) / n)

    end function label_of

  end subroutine find_neighbours

  !> Note the neighbour beyond a side.
  pure subroutine pair(surface, one, other)
    type(surface_t), intent(inout) :: surface
    !> Sides, numbered over all facets.
    integer, intent(in) :: one
    integer, intent(in) :: other

    integer :: facet, side

    associate (n => surface%n_corner)
      facet = 1 + (one - 1) / n
      side = one - n * (facet - 1)
      surface%neighbour(side, facet) = 1 + (other - 1) / n
      surface%neighbour_side(side, facet) = 1 + mod(other - 1, n)
    end associate

  end subroutine pair

  !> Neighbours must agree about the outside: go from facet to facet.
  pure subroutine orient(name, reorient, surface, part, status)
    character(len=*), intent(in) :: name
    logical, intent(in) :: reorient
    type(surface_t), intent(inout) :: surface
    !> Number of the connected part that each facet belongs to.
    integer, allocatable, intent(out) :: part(:)
    type(status_t), intent(inout) :: status

    integer :: facet, k, n_part, n_waiting, neighbour, start
    integer, allocatable :: waiting(:)

    allocate (part(surface%n_facet), waiting(surface%n_facet), source=0)
    n_part = 0
    do start = 1, surface%n_facet
      if (part(start) > 0) cycle
      n_part = n_part + 1
      part(start) = n_part
      n_waiting = 1
      waiting(1) = start
      do while (n_waiting > 0)
        facet = waiting(n_waiting)
        n_waiting = n_waiting - 1
        do k = 1, surface%n_corner
          neighbour = surface%neighbour(k, facet)
          if (neighbour == 0) cycle
          if (.not. agree(surface, facet, k)) then
            if (part(neighbour) == 0 .and. reorient) then
              call turn(surface, neighbour)
            else if (reorient) then
              call status%raise(STATUS_ERROR, 'surface_create', name//': the surface has only '// &
                                'one side, as a Moebius strip: it turns over at facet '// &
                                text(surface%label(facet)), EXIT_MESH)
              return
            else
              call status%raise(STATUS_ERROR, 'surface_create', name//': facet '// &
                                text(surface%label(facet))//' and its neighbour facet '// &
                                text(surface%label(neighbour))//' have opposite normals: all '// &
                                'must point out of the tool (reorient = .true. turns them)', &
                                EXIT_MESH)
              return
            end if
          end if
          if (part(neighbour) > 0) cycle
          part(neighbour) = n_part
          n_waiting = n_waiting + 1
          waiting(n_waiting) = neighbour
        end do
      end do
    end do

  end subroutine orient

  !> True when a facet and its neighbour beyond a side have the same side outside: they pass their
  !> common side in opposite directions.
  pure function agree(surface, facet, side)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    integer, intent(in) :: side
    logical :: agree

    associate (other => surface%neighbour(side, facet), &
               other_side => surface%neighbour_side(side, facet))
      if (surface%n_corner == 3) then
        agree = surface%vertex(side, facet) /= surface%vertex(other_side, other)
      else
        agree = side /= other_side
      end if
    end associate

  end function agree

  !> Turn a facet over. Its sides get other numbers.
  pure subroutine turn(surface, facet)
    type(surface_t), intent(inout) :: surface
    integer, intent(in) :: facet

    integer :: k
    integer, allocatable :: sides(:)

    surface%n_turned = surface%n_turned + 1
    if (surface%n_corner == 3) then
      ! Corners 1 3 2: the sides are now 3-1, 2-3 and 1-2 of before
      surface%vertex(:, facet) = surface%vertex([1, 3, 2], facet)
      allocate (sides(3))
      sides = [3, 2, 1]
    else
      surface%vertex(:, facet) = surface%vertex([2, 1], facet)
      allocate (sides(2))
      sides = [2, 1]
    end if
    surface%neighbour(:, facet) = surface%neighbour(sides, facet)
    surface%neighbour_side(:, facet) = surface%neighbour_side(sides, facet)
    do k = 1, surface%n_corner
      if (surface%neighbour(k, facet) == 0) cycle
      surface%neighbour_side(surface%neighbour_side(k, facet), surface%neighbour(k, facet)) = k
    end do

  end subroutine turn

  !> The volume that closed parts enclose; all must have the outside on the same side.
  pure subroutine measure_parts(name, reorient, part, surface, status)
    character(len=*), intent(in) :: name
    logical, intent(in) :: reorient
    integer, intent(in) :: part(:)
    type(surface_t), intent(inout) :: surface
    type(status_t), intent(inout) :: status

    integer :: facet, n_part
    real(wp), allocatable :: volume(:)

    if (.not. surface%closed) return
    n_part = maxval(part)
    allocate (volume(n_part), source=0.0_wp)
    do facet = 1, surface%n_facet
      volume(part(facet)) = volume(part(facet)) + volume_under(surface, facet)
    end do
    if (reorient) then
      do facet = 1, surface%n_facet
        if (volume(part(facet)) < 0.0_wp) call turn(surface, facet)
      end do
      volume = abs(volume)
    end if
    surface%volume = sum(volume)
    do facet = 1, surface%n_facet
      if ((volume(part(facet)) < 0.0_wp) .eqv. (surface%volume < 0.0_wp)) cycle
      call status%raise(STATUS_ERROR, 'surface_create', name//': the part of the surface that '// &
                        'facet '//text(surface%label(facet))//' belongs to is turned inside '// &
                        'out: unlike in other parts its normals point to the other side '// &
                        '(reorient = .true. turns it)', EXIT_MESH)
      return
    end do

  end subroutine measure_parts

  !> Share of a facet in the enclosed volume.
  pure function volume_under(surface, facet) result(volume)
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: facet
    real(wp) :: volume

    real(wp) :: a(3), b(3), c(3)

    ! From a point of the surface, so that one far from the origin loses nothing
    a = surface%x(:, surface%vertex(1, facet)) - surface%x(:, 1)
    b = surface%x(:, surface%vertex(2, facet)) - surface%x(:, 1)
    if (surface%n_corner == 3) then
      c = surface%x(:, surface%vertex(3, facet)) - surface%x(:, 1)
      volume = dot_product(a, cross_product(b, c)) / 6.0_wp
    else
      volume = 0.5_wp * (a(1) * b(2) - a(2) * b(1))
    end if

  end function volume_under

  pure subroutine find_normals(surface)
    type(surface_t), intent(inout) :: surface

    integer :: facet
    real(wp) :: height, longest, normal(3)

    allocate (surface%normal(3, surface%n_facet), source=0.0_wp)
    do facet = 1, surface%n_facet
      associate (x => surface%x(:, surface%vertex(:, facet)))
        if (surface%n_corner == 2) then
          normal = [x(2, 2) - x(2, 1), x(1, 1) - x(1, 2), 0.0_wp]
          surface%normal(:, facet) = normal / norm2(normal)
          cycle
        end if
        normal = cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
        longest = max(norm2(x(:, 2) - x(:, 1)), norm2(x(:, 3) - x(:, 2)), norm2(x(:, 1) - x(:, 3)))
        height = norm2(normal) / longest
        if (height > NEEDLE * longest) surface%normal(:, facet) = normal / norm2(normal)
      end associate
    end do

  end subroutine find_normals

end module swage_surface
