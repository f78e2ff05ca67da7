!> Enforcement of the contacts of [[swage_mechanics]] around the Newton iterations.
submodule(swage_mechanics) swage_mechanics_contact
  implicit none(type, external)

  !> Error of the forces above which the present slip tells little about that of the solution.
  real(wp), parameter :: FAR_OFF = 0.3_wp

contains

  module procedure mechanics_augment

    real(wp) :: measures(4), penetration(size(self%contacts))
    integer :: i, k
    logical :: contact_done, gives_up

    done = .true.
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        call contact%measure(measures)
        do k = 1, size(measures)
          call self%comm%max(measures(k))
        end do
        call contact%augment(self%tools(contact%tool), measures, contact_done, gives_up)
        if (gives_up) then
          call status%raise(STATUS_RETRY, 'mechanics_augment', 'contact '//contact%name// &
                            ': nodes cannot settle whether they touch', EXIT_CONVERGENCE)
        end if
        done = done .and. contact_done
        penetration(i) = measures(1)
      end associate
    end do
    if (.not. done) return
    do i = 1, size(self%contacts)
      call note_augmentations(self, i, penetration(i))
    end do

  end procedure mechanics_augment

  module procedure prepare_contacts

    integer :: i
    logical :: takes_secants

    takes_secants = self%needs_safe_tangent .or. &
      (self%n_evaluation == 1 .and. self%starts_from_rest) .or. self%errors(1) > FAR_OFF
    do i = 1, size(self%contacts)
      call self%contacts(i)%watch(takes_secants, self%matrix)
    end do

  end procedure prepare_contacts

  !> A line for the log about a step that took augmentations.
  subroutine note_augmentations(self, i, penetration)
    class(mechanics_t), intent(inout) :: self
    !> Place of the contact.
    integer, intent(in) :: i
    !> By the cell size [1].
    real(wp), intent(in) :: penetration

    character(len=:), allocatable :: line

    associate (contact => self%contacts(i))
      if (contact%n_augmentation == 0) return
      line = 'contact '//contact%name//': '//text(contact%n_augmentation)// &
        ' augmentations, penetration '//text(penetration)//' of a cell'
      if (contact%growth > contact%growth_old) then
        line = line//', penalty '//text(contact%growth)//' times that of the start'
      end if
      if (penetration > contact%enforcement%penetration_tolerance) then
        line = line//': above penetration_tolerance, but maximum_augmentations is reached'
      end if
    end associate
    if (self%notes /= '') self%notes = self%notes//new_line('a')
    self%notes = self%notes//line

  end subroutine note_augmentations

end submodule swage_mechanics_contact
