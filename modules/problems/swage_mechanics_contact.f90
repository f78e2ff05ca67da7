!> Enforcement of the contacts of [[swage_mechanics]] around the Newton iterations.
submodule(swage_mechanics) swage_mechanics_contact
  use swage_contact_state, only: contact_state_t
  implicit none(type, external)

  !> Error of the forces above which the present slip tells little about that of the solution.
  real(wp), parameter :: FAR_OFF = 0.3_wp

contains

  module procedure mechanics_augment

    real(wp) :: among_bodies(size(self%pairs)), measures(4), penetration(size(self%contacts))
    integer :: i
    logical :: contact_done, gives_up

    done = .true.
    self%asks_for_correction = .false.
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        call measure(self, contact%contact_state_t, measures)
        call contact%augment(self%tools(contact%tool), measures, contact_done, gives_up)
        if (gives_up) call give_up(contact%contact_state_t, status)
        done = done .and. contact_done
        self%asks_for_correction = self%asks_for_correction &
          .or. (contact%enforcement%within_newton .and. .not. contact_done &
                .and. measures(1) > contact%enforcement%penetration_tolerance)
        penetration(i) = measures(1)
      end associate
    end do
    do i = 1, size(self%pairs)
      associate (contact => self%pairs(i)%contact)
        call measure(self, contact%contact_state_t, measures)
        call contact%augment(measures, contact_done, gives_up)
        if (gives_up) call give_up(contact%contact_state_t, status)
        done = done .and. contact_done
        self%asks_for_correction = self%asks_for_correction &
          .or. (contact%enforcement%within_newton .and. .not. contact_done &
                .and. measures(1) > contact%enforcement%penetration_tolerance)
        among_bodies(i) = measures(1)
      end associate
    end do
    if (.not. done) return
    call check_depth(self, status)
    if (status%failed()) return
    do i = 1, size(self%contacts)
      call note_alternation(self, self%contacts(i)%contact_state_t)
    end do
    do i = 1, size(self%pairs)
      call note_alternation(self, self%pairs(i)%contact%contact_state_t)
    end do
    do i = 1, size(self%contacts)
      call note_augmentations(self, self%contacts(i)%contact_state_t, penetration(i))
    end do
    do i = 1, size(self%pairs)
      call note_augmentations(self, self%pairs(i)%contact%contact_state_t, among_bodies(i))
    end do

  end procedure mechanics_augment

  !> Collective. Maxima over all ranks of what decides about augmentations.
  subroutine measure(self, contact, measures)
    class(mechanics_t), intent(in) :: self
    type(contact_state_t), intent(in) :: contact
    real(wp), intent(out) :: measures(4)

    integer :: k

    call contact%measure(measures)
    do k = 1, size(measures)
      call self%comm%max(measures(k))
    end do

  end subroutine measure

  subroutine give_up(contact, status)
    type(contact_state_t), intent(in) :: contact
    type(status_t), intent(inout) :: status

    call status%raise(STATUS_RETRY, 'mechanics_augment', 'contact '//contact%name// &
                      ': nodes cannot settle whether they touch', EXIT_CONVERGENCE)

  end subroutine give_up

  !> Bodies that have gone through each other deeper than conditions reach must not go on as if
  !> there were no contact. All ranks know the surfaces, and find the same.
  subroutine check_depth(self, status)
    type(mechanics_t), intent(in) :: self
    type(status_t), intent(inout) :: status

    real(wp) :: place(3)
    integer :: i
    logical :: lost

    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i))
        if (pair%contact%is_tied) cycle
        call pair%surfaces%find_lost(lost, place)
        if (.not. lost) cycle
        call status%raise(STATUS_RETRY, 'mechanics_augment', 'contact '//pair%contact%name// &
                          ': bodies go through each other'// &
                          near(place(:self%mesh%dimension))//', deeper than their cells ('// &
                          text(pair%surfaces%depth)//' [length])', EXIT_CONVERGENCE)
      end associate
    end do

  end subroutine check_depth

  module procedure prepare_contacts

    type(contact_blocks_t) :: secants
    integer :: i, k
    logical :: takes_secants, takes_turns

    takes_secants = (self%n_evaluation == 1 .and. self%starts_from_rest) &
      .or. self%errors(1) > FAR_OFF
    takes_turns = .false.
    if (self%needs_safe_tangent .and. .not. takes_secants) then
      ! Where the secants of all have not helped either, a few points that belong between sliding
      ! one way and the other hold up the rest
      if (self%has_secants) takes_turns = has_turned(self)
      takes_secants = .not. takes_turns
    end if
    self%has_secants = takes_secants
    do i = 1, size(self%contacts)
      call self%contacts(i)%watch(takes_secants, takes_turns, self%matrix)
      call self%contacts(i)%start_correction()
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%start_correction()
      call secants%start()
      call self%pairs(i)%contact%watch(takes_secants, takes_turns, self%pairs(i)%rows, secants)
      do k = 1, secants%n
        call self%matrix%coupling%add(secants%row(k), secants%column(k), secants%block(:, :, k), &
                                      .false.)
      end do
    end do

  end procedure prepare_contacts

  !> Collective. True when friction has turned about anywhere in the last correction.
  function has_turned(self) result(turned)
    class(mechanics_t), intent(in) :: self
    logical :: turned

    integer(gp) :: n
    integer :: i

    n = 0_gp
    do i = 1, size(self%contacts)
      n = n + count(self%contacts(i)%turn_secant > 0.0_wp, kind=gp)
    end do
    do i = 1, size(self%pairs)
      n = n + count(self%pairs(i)%contact%turn_secant > 0.0_wp, kind=gp)
    end do
    call self%comm%sum(n)
    turned = n > 0_gp

  end function has_turned

  !> Collective. A line for the log about a step in which conditions alternated.
  subroutine note_alternation(self, contact)
    class(mechanics_t), intent(inout) :: self
    type(contact_state_t), intent(in) :: contact

    integer(gp) :: n

    n = count(contact%held, kind=gp)
    call self%comm%sum(n)
    if (n == 0_gp) return
    if (self%notes /= '') self%notes = self%notes//new_line('a')
    self%notes = self%notes//'contact '//contact%name//': active-set flip-flop detected and '// &
      'cured: '//text(int(n))//' conditions that alternated between contact and none were '// &
      'held, and settled after '//text(contact%n_release)//' releases'

  end subroutine note_alternation

  !> A line for the log about a step that took augmentations.
  subroutine note_augmentations(self, contact, penetration)
    class(mechanics_t), intent(inout) :: self
    type(contact_state_t), intent(in) :: contact
    !> By the cell size [1].
    real(wp), intent(in) :: penetration

    character(len=:), allocatable :: line

    if (contact%n_augmentation == 0) return
    line = 'contact '//contact%name//': '//text(contact%n_augmentation)// &
      ' augmentations, penetration '//text(penetration)//' of a cell'
    if (contact%growth > contact%growth_old) then
      line = line//', penalty '//text(contact%growth)//' times that of the start'
    end if
    if (penetration > contact%enforcement%penetration_tolerance) then
      line = line//': above penetration_tolerance, but maximum_augmentations is reached'
    end if
    if (self%notes /= '') self%notes = self%notes//new_line('a')
    self%notes = self%notes//line

  end subroutine note_augmentations

end submodule swage_mechanics_contact
