!> What [[swage_mechanics]] says of a step that failed.
submodule(swage_mechanics) swage_mechanics_diagnosis
  use swage_contact_state, only: AUGMENTED_LAGRANGIAN, contact_census_t, contact_state_t, &
    CENSUS_ITERATIONS
  implicit none(type, external)

  !> A node deeper than this share of its cell is where it should not be.
  real(wp), parameter :: DEEP = 0.1_wp

  !> A contact under suspicion.
  type :: suspect_t
    type(contact_census_t) :: census
    !> Node of the mesh that is deepest, 0 on all ranks but one.
    integer :: node = 0
    !> The node with the largest force is one of its own.
    logical :: has_worst = .false.
  end type suspect_t

contains

  module procedure mechanics_describe_worst

    real(wp) :: largest

    largest = self%worst_force
    call self%comm%max(largest)
    place = 'force error '//text(self%errors(1))//', volume error '//text(self%errors(2))// &
      ', largest force at '//said_by(self, self%worst_node > 0 .and. &
                                     .not. self%worst_force < largest, self%worst_node)// &
      out_of_balance(self)

  end procedure mechanics_describe_worst

  module procedure mechanics_blame_contact

    type(suspect_t) :: suspect, worst
    real(wp) :: largest
    integer :: i, n, n_active
    logical :: is_worst_here

    words = ''
    n = size(self%contacts) + size(self%pairs)
    if (n == 0 .or. self%n_evaluation == 0) return
    largest = self%worst_force
    call self%comm%max(largest)
    is_worst_here = .not. self%worst_force < largest
    n_active = 0
    do i = 1, n
      call question(self, i, is_worst_here, suspect)
      n_active = n_active + suspect%census%n_active
      if (.not. is_more_suspect(suspect, worst)) cycle
      worst = suspect
      if (i <= size(self%contacts)) then
        words = words_about(self, self%contacts(i)%contact_state_t, suspect)
      else
        words = words_about(self, self%pairs(i - size(self%contacts))%contact%contact_state_t, &
                            suspect)
      end if
    end do
    if (n_active > 0) return
    words = '; no contact touches: a body that no boundary holds rests on nothing'

  end procedure mechanics_blame_contact

  !> Collective. Ask one contact.
  subroutine question(self, i, is_worst_here, suspect)
    class(mechanics_t), intent(in) :: self
    !> Of tools first, then of pairs.
    integer, intent(in) :: i
    !> The node with the largest force is on this rank.
    logical, intent(in) :: is_worst_here
    type(suspect_t), intent(out) :: suspect

    real(wp) :: deepest
    integer :: has_worst, k

    has_worst = 0
    if (i <= size(self%contacts)) then
      associate (contact => self%contacts(i))
        call contact%take_census(suspect%census)
        if (suspect%census%deepest > 0) suspect%node = contact%node(suspect%census%deepest)
        if (is_worst_here .and. any(contact%node == self%worst_node)) has_worst = 1
      end associate
    else
      associate (pair => self%pairs(i - size(self%contacts)))
        call pair%contact%take_census(suspect%census)
        ! Nodes with nothing opposite have no condition, nor have most of the master's
        suspect%census%counts(3) = int(pair%rows%n_row, gp)
        if (suspect%census%deepest > 0) suspect%node = pair%contact%node(suspect%census%deepest)
        if (is_worst_here) then
          do k = 1, self%surface%n_node
            if (self%surface%mesh_node(k) /= self%worst_node) cycle
            if (any(pair%surfaces%slave%node == k) .or. any(pair%surfaces%master%node == k)) then
              has_worst = 1
            end if
          end do
        end if
      end associate
    end if
    associate (census => suspect%census)
      call self%comm%sum(census%counts)
      deepest = census%share
      call self%comm%max(deepest)
      if (census%share < deepest) suspect%node = 0
      census%share = deepest
      census%n_active = int(census%counts(1))
      census%n_changed = int(census%counts(2))
      census%n = int(census%counts(3))
      call self%comm%max(census%starts_inside)
    end associate
    call self%comm%max(has_worst)
    suspect%has_worst = has_worst > 0

  end subroutine question

  !> States that change come first, then nodes that are deep inside, then the largest force.
  pure function is_more_suspect(suspect, other) result(is_more)
    type(suspect_t), intent(in) :: suspect
    type(suspect_t), intent(in) :: other
    logical :: is_more

    associate (a => suspect%census, b => other%census)
      if (a%n_changed /= b%n_changed) then
        is_more = a%n_changed > b%n_changed
      else if (max(a%share, b%share) > DEEP) then
        is_more = a%share > b%share
      else
        is_more = suspect%has_worst .and. .not. other%has_worst
      end if
    end associate

  end function is_more_suspect

  !> Collective. The state of a contact, and which key may help.
  function words_about(self, contact, suspect) result(words)
    class(mechanics_t), intent(in) :: self
    type(contact_state_t), intent(in) :: contact
    type(suspect_t), intent(in) :: suspect
    character(len=:), allocatable :: words

    associate (census => suspect%census)
      words = '; contact '//contact%name//': '//text(census%n_active)//' of '//text(census%n)// &
        ' conditions touch, '//text(census%n_changed)//' changed their state in the last '// &
        text(CENSUS_ITERATIONS)//' iterations'
      if (census%share > 0.0_wp) then
        words = words//', the deepest is '//text(census%share)//' of a cell inside, at '// &
          said_by(self, suspect%node > 0, suspect%node)
      end if
      if (census%n_changed > 0) then
        words = words//': give shorter increments, or a smaller penalty_factor'
        if (contact%enforcement%kind /= AUGMENTED_LAGRANGIAN) then
          words = words//' or enforcement = ''augmented_lagrangian'''
        end if
      else if (census%share > DEEP .and. census%starts_inside > 0.0_wp) then
        words = words//', where it was drawn: give adjust or draw the bodies apart'
      else if (census%share > DEEP) then
        words = words//': give shorter increments, or a larger penalty_factor'
      else if (suspect%has_worst .and. contact%friction%is_regularised) then
        words = words//'; slip that changes its direction asks for a larger '// &
          'regularisation_velocity'
      end if
    end associate

  end function words_about

  !> Collective. Name and place of a node of the lowest rank that has one to name.
  function said_by(self, speaks, node) result(words)
    class(mechanics_t), intent(in) :: self
    !> Whether this rank has.
    logical, intent(in) :: speaks
    !> Of the mesh, where it does.
    integer, intent(in) :: node
    character(len=:), allocatable :: words

    type(status_t) :: speaker

    if (speaks) then
      call speaker%raise(STATUS_RETRY, 'said_by', 'node '//text(int(self%mesh%node_tag(node)))// &
                         near(self%mesh%coordinates(:, node)))
    end if
    call self%comm%agree(speaker)
    words = trim(speaker%message)

  end function said_by

end submodule swage_mechanics_diagnosis
