!> Contacts of [[swage_mechanics]] between bodies, from the input: which surfaces they bring
!> together.
submodule(swage_mechanics:swage_mechanics_contact_setup) swage_mechanics_pair_setup
  use swage_contact_pair, only: contact_pair_create
  use swage_coupling_matrix, only: coupling_matrix_create
  use swage_shared_surface, only: shared_surface_create
  use swage_slave_choice, only: choose_slave, contact_side_t, measure_sides, warn_of_coarse_slave
  implicit none(type, external)

  interface
    !> Collective. A pair of surfaces with its formulation and what is enforced there.
    module subroutine create_pair(self, group, keys, law, slave, master, nodal, pair, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(group_t), intent(inout) :: group
      type(contact_keys_t), intent(in) :: keys
      class(friction_law_t), intent(in) :: law
      !> Facets of the shared surface.
      integer, intent(in) :: slave(:), master(:)
      !> See `nodal_stiffness`.
      real(wp), intent(in) :: nodal(:, :)
      type(body_pair_t), intent(inout) :: pair
      type(status_t), intent(inout) :: status
    end subroutine create_pair
  end interface

contains

  module procedure read_pairs

    class(friction_law_t), allocatable :: law
    type(contact_keys_t) :: keys
    type(group_t) :: group
    integer, allocatable :: master(:), slave(:)
    integer(gp), allocatable :: in_use(:, :)
    integer :: i, k

    allocate (self%pairs(size(places)))
    if (size(places) == 0) return
    ! Which facets each pair has, as bits of the slave and the master of this rank's facets
    allocate (in_use(2 * size(places), self%mesh%n_facet), source=0_gp)
    do k = 1, size(places)
      call deck%get('contact', places(k), group)
      call take_contact(group, keys)
      call find_sides(self, group, keys, slave, master)
      call need_surface(self, group, key_of_side(keys, 'slave'), slave)
      call need_surface(self, group, key_of_side(keys, 'master'), master)
      call check_sides(self, group, key_of_side(keys, 'master'), slave, master)
      call group%finish(status)
      if (status%failed()) return
      in_use(2 * k - 1, slave) = 1_gp
      in_use(2 * k, master) = 1_gp
      call check_doubles(self, deck, places(:k), in_use, status)
      if (status%failed()) return
    end do
    call share_surface(self, any(in_use > 0_gp, dim=1))
    do k = 1, size(places)
      call deck%get('contact', places(k), group)
      call take_contact(group, keys)
      associate (sides => in_use(2 * k - 1:2 * k, :))
        call compare_sides(self, group, keys, nodal, sides, self%pairs(k))
        slave = pack([(i, i=1, size(sides, 2))], sides(1, :) > 0_gp)
        call find_friction(self, deck, group, keys, slave, law, status)
        if (status%failed()) return
        call create_pair(self, group, keys, law, on_surface(self, sides(1, :)), &
                         on_surface(self, sides(2, :)), nodal, self%pairs(k), status)
        if (status%failed()) return
      end associate
    end do

  end procedure read_pairs

  !> Collective. Both sides of a contact are one surface, or different ones.
  subroutine check_sides(self, group, key, slave, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    !> That a fault is laid to.
    character(len=*), intent(in) :: key
    integer, intent(in) :: slave(:)
    integer, intent(in) :: master(:)

    logical :: is_slave(self%mesh%n_facet)
    integer(gp) :: n_all(2), n_shared

    is_slave = .false.
    is_slave(slave) = .true.
    n_shared = count(is_slave(master), kind=gp)
    n_all = [size(slave, kind=gp), size(master, kind=gp)]
    call self%comm%sum(n_shared)
    call self%comm%sum(n_all)
    if (n_shared == 0_gp .or. all(n_all == n_shared)) return
    call group%refuse(key, 'gives '//text(int(n_shared))//' facets to both slave and master: '// &
                      'the two sides of a contact must be different surfaces, or one that may '// &
                      'fold onto itself')

  end subroutine check_sides

  !> Collective. Facets that meet by two contacts would be pushed twice.
  subroutine check_doubles(self, deck, places, in_use, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    !> Of the pairs so far among the groups `&contact`.
    integer, intent(in) :: places(:)
    !> 1 for the facets of the slave and of the master of each pair; shape (:, n_facet).
    integer(gp), intent(in) :: in_use(:, :)
    type(status_t), intent(inout) :: status

    type(group_t) :: earlier, group
    integer(gp) :: common(4)
    integer :: k, last

    last = size(places)
    associate (slave => in_use(2 * last - 1, :), master => in_use(2 * last, :))
      do k = 1, last - 1
        common = [sum(slave * in_use(2 * k - 1, :)), sum(master * in_use(2 * k, :)), &
                  sum(slave * in_use(2 * k, :)), sum(master * in_use(2 * k - 1, :))]
        call self%comm%sum(common)
        if (.not. (all(common(:2) > 0_gp) .or. all(common(3:) > 0_gp))) cycle
        call deck%get('contact', places(k), earlier)
        call deck%get('contact', places(last), group)
        call status%raise(STATUS_ERROR, 'check_doubles', group%title//': &contact '''// &
                          earlier%name//''' brings facets of the same two surfaces in touch '// &
                          'already: each pair of surfaces needs one contact, and both passes '// &
                          'over it are formulation = ''symmetric''')
        return
      end do
    end associate

  end subroutine check_doubles

  !> Collective. Bring all facets that may meet others to all ranks, and make room for what couples
  !> them.
  subroutine share_surface(self, is_used)
    type(mechanics_t), intent(inout) :: self
    !> Facets of this rank's mesh.
    logical, intent(in) :: is_used(:)

    integer, allocatable :: unknown_node(:)
    integer(gp), allocatable :: node_global(:)
    integer :: i

    call shared_surface_create(self%comm, self%mesh, pack([(i, i=1, size(is_used))], is_used), &
                               pack(self%body_of_cell(self%mesh%facet_cell), is_used), &
                               self%surface)
    associate (surface => self%surface)
      allocate (self%surface_start(3, surface%n_node), self%surface_moved(3, surface%n_node))
      allocate (self%matrix%coupling)
      allocate (unknown_node(surface%n_node), source=0)
      allocate (node_global(surface%n_node), source=0_gp)
      do i = 1, surface%n_node
        if (surface%mesh_node(i) == 0) cycle
        unknown_node(i) = self%unknowns%of_node(surface%mesh_node(i))
        if (surface%is_own(i)) node_global(i) = self%unknowns%node_global(unknown_node(i))
      end do
      call self%comm%sum(node_global)
      call coupling_matrix_create(self%comm, self%mesh%dimension, node_global, unknown_node, &
                                  surface%is_own, self%matrix%coupling)
    end associate

  end subroutine share_surface

  !> Collective. Facets of the shared surface, from those of this rank that are marked.
  function on_surface(self, is_marked) result(places)
    type(mechanics_t), intent(in) :: self
    !> 1 or 0; shape (n_facet of the mesh).
    integer(gp), intent(in) :: is_marked(:)
    integer, allocatable :: places(:)

    integer(gp), allocatable :: marks(:)
    integer :: i

    allocate (marks(self%surface%n_facet), source=0_gp)
    do i = 1, size(marks)
      if (self%surface%mesh_facet(i) > 0) marks(i) = is_marked(self%surface%mesh_facet(i))
    end do
    call self%comm%sum(marks)
    allocate (places, source=pack([(i, i=1, size(marks))], marks > 0_gp))

  end function on_surface

  !> Collective. Choose the slave where the keys leave that open, else judge it.
  subroutine compare_sides(self, group, keys, nodal, in_use, pair)
    type(mechanics_t), intent(inout) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    !> See `nodal_stiffness`.
    real(wp), intent(in) :: nodal(:, :)
    !> 1 for the facets of the slave and of the master; exchanged where the second one is to be the
    !> slave; shape (2, n_facet).
    integer(gp), intent(inout) :: in_use(:, :)
    !> Gets what is to be said about it.
    type(body_pair_t), intent(inout) :: pair

    type(contact_pair_t) :: surfaces
    type(contact_side_t) :: sides(2)
    real(wp), allocatable :: all_nodal(:, :)
    integer, allocatable :: master(:), slave(:)
    real(wp) :: reach
    integer :: chosen

    pair%choice = ''
    pair%warning = ''
    if (.not. (keys%chooses .or. keys%formulation == 'master_slave')) return
    allocate (slave, source=on_surface(self, in_use(1, :)))
    allocate (master, source=on_surface(self, in_use(2, :)))
    if (size(slave) == size(master)) then
      if (all(slave == master)) return
    end if
    associate (surface => self%surface)
      allocate (all_nodal(2, surface%n_node))
      call surface%gather(nodal(:2, :), all_nodal)
      call surface%gather(self%mesh%coordinates, self%surface_start)
      reach = maxval(all_nodal(2, :))
      call contact_pair_create(self%mesh%dimension, self%settings%kind == AXISYMMETRIC, &
                               surface%facet_node(:, slave), surface%facet_node(:, master), &
                               surface%n_node, reach, reach, .false., 1.0_wp, surfaces)
      call surfaces%begin_step(self%surface_start)
    end associate
    sides(1)%name = trim(keys%slave(1))
    sides(2)%name = keys%master
    call measure_sides(surfaces, all_nodal(1, :) * all_nodal(2, :), sides(1), sides(2))
    if (keys%chooses) then
      call choose_slave(sides, chosen, pair%choice)
      if (chosen == 2) in_use = in_use([2, 1], :)
    else
      call warn_of_coarse_slave(sides(1), sides(2), pair%warning)
      if (pair%warning /= '') pair%warning = group%describe('slave')//': '//pair%warning
    end if

  end subroutine compare_sides

end submodule swage_mechanics_pair_setup
