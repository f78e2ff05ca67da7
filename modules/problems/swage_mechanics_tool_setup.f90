!> Contacts of [[swage_mechanics]] with tools, from the input.
submodule(swage_mechanics:swage_mechanics_contact_setup) swage_mechanics_tool_setup
  use swage_contact_keys, only: penalty_of, refuse_formulation
  use swage_group, only: NAME_LENGTH
  use swage_spelling, only: did_you_mean, listed
  use swage_tool_contact, only: tool_contact_create
  implicit none(type, external)

contains

  module procedure read_tool_contacts

    class(friction_law_t), allocatable :: law
    type(contact_keys_t) :: keys
    type(group_t) :: group
    integer, allocatable :: facet(:), node(:)
    real(wp) :: penalty
    integer :: i, j, tool

    allocate (self%contacts(size(places)))
    do i = 1, size(places)
      call deck%get('contact', places(i), group)
      call take_contact(group, keys)
      if (keys%chooses) call refuse_choice(self, group, keys)
      call refuse_formulation(group)
      call find_facets(self, group, 'slave', keys%slave, facet)
      call need_surface(self, group, 'slave', facet)
      tool = 0
      do j = 1, size(self%tools)
        if (self%tools(j)%name == keys%master) tool = j
      end do
      if (tool == 0) call refuse_master(self, group, keys%master)
      call group%finish(status)
      if (status%failed()) return
      call find_friction(self, deck, group, keys, facet, law, status)
      if (status%failed()) return
      call check_doubles(self, i, tool, facet, group, status)
      if (status%failed()) return
      call surface_nodes(self, facet, node)
      penalty = penalty_of(keys, keys%enforcement)
      call tool_contact_create(group%name, tool, law, keys%separation, facet, node, &
                               self%mesh%node_tag(node), nodal(2, node), &
                               penalty * nodal(1, node), &
                               penalty * keys%tangential * nodal(1, node), keys%enforcement, &
                               keys%inertia, self%contacts(i))
      call check_overlap(self, self%contacts(i), group, status)
      if (status%failed()) return
    end do
    call check_controls(self, deck, status)

  end procedure read_tool_contacts

  !> A master must be known.
  subroutine refuse_master(self, group, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: master

    character(len=NAME_LENGTH) :: known(size(self%tools) + size(self%bodies))
    integer :: i, n

    if (master == '') return
    n = size(self%tools)
    do i = 1, n
      known(i) = self%tools(i)%name
    end do
    do i = 1, size(self%bodies)
      known(n + i) = self%bodies(i)%name
    end do
    call group%refuse('master', 'there is neither a &tool nor a &body named '''//master//''''// &
                      did_you_mean(master, known)//' Known names: '//listed(known, ', ', '''')// &
                      '; '//self%mesh%explain_group(master, self%mesh%dimension - 1))

  end subroutine refuse_master

  !> The second of two `bodies` is none.
  subroutine refuse_choice(self, group, keys)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys

    integer, allocatable :: ignored(:)

    call find_facets(self, group, 'bodies', [character(len=64) :: keys%slave, keys%master], ignored)

  end subroutine refuse_choice

  !> Collective. A facet that meets a tool by two contacts would be pushed twice.
  subroutine check_doubles(self, n, tool, facet, group, status)
    type(mechanics_t), intent(in) :: self
    !> Place of the contact in hand; those before it are made.
    integer, intent(in) :: n
    integer, intent(in) :: tool
    integer, intent(in) :: facet(:)
    !> `&contact`.
    type(group_t), intent(in) :: group
    type(status_t), intent(inout) :: status

    integer(gp) :: n_shared
    integer :: i
    logical :: touching(self%mesh%n_facet)

    do i = 1, n - 1
      if (self%contacts(i)%tool /= tool) cycle
      touching = .false.
      touching(self%contacts(i)%facet) = .true.
      n_shared = count(touching(facet), kind=gp)
      call self%comm%sum(n_shared)
      if (n_shared == 0_gp) cycle
      call status%raise(STATUS_ERROR, 'check_doubles', group%describe('slave')//': &contact '''// &
                        self%contacts(i)%name//''' brings '//text(int(n_shared))//' of its '// &
                        'facets in touch with tool '''//self%tools(tool)%name//''' already: '// &
                        'each needs one contact with a tool')
      return
    end do

  end subroutine check_doubles

  !> Collective. This rank's own nodes of a surface whose facets may lie on other ranks.
  subroutine surface_nodes(self, facet, node)
    type(mechanics_t), intent(in) :: self
    integer, intent(in) :: facet(:)
    integer, allocatable, intent(out) :: node(:)

    real(wp), allocatable :: touched(:, :)
    integer :: i

    allocate (touched(1, self%mesh%n_node), source=0.0_wp)
    do i = 1, size(facet)
      touched(1, self%mesh%facet_node(:, facet(i))) = 1.0_wp
    end do
    call self%mesh%halo%accumulate(touched)
    node = pack([(i, i=1, self%mesh%n_own_node)], touched(1, :self%mesh%n_own_node) > 0.0_wp)

  end subroutine surface_nodes

  !> A tool drawn into the body is a mistake in the input.
  subroutine check_overlap(self, contact, group, status)
    type(mechanics_t), intent(in) :: self
    type(tool_contact_t), intent(in) :: contact
    type(group_t), intent(in) :: group
    type(status_t), intent(inout) :: status

    real(wp) :: deepest, hessian(3, 3), normal(3), penetration, x(3)
    integer :: i, worst

    deepest = 0.0_wp
    worst = 0
    do i = 1, size(contact%node)
      x = 0.0_wp
      x(:self%mesh%dimension) = self%mesh%coordinates(:, contact%node(i))
      call self%tools(contact%tool)%project(x, penetration, normal, hessian)
      if (penetration > LARGEST_OVERLAP * contact%size(i) .and. penetration > deepest) then
        deepest = penetration
        worst = contact%node(i)
      end if
    end do
    if (worst > 0) then
      call status%raise(STATUS_ERROR, 'check_overlap', group%describe('master')// &
                        ': at the start node '//text(int(self%mesh%node_tag(worst)))// &
                        near(self%mesh%coordinates(:, worst))//' is '//text(deepest)// &
                        ' [length] inside the tool, more than a tenth of its cells: move the '// &
                        'tool out of the body')
    end if
    call self%comm%agree(status)

  end subroutine check_overlap

  !> Forces on a tool that nothing can touch have nothing to balance them.
  subroutine check_controls(self, deck, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    type(group_t) :: group
    integer :: i

    do i = 1, size(self%tools)
      if (size(self%tools(i)%controls) == 0 .or. any(self%contacts%tool == i)) cycle
      call deck%get('tool', i, group)
      call status%raise(STATUS_ERROR, 'check_controls', group%describe('controls')//': no '// &
                        '&contact has this tool as its master: nothing balances the forces on it')
      return
    end do

  end subroutine check_controls

end submodule swage_mechanics_tool_setup
