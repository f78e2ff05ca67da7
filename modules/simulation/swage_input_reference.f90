!> All groups of the input file. A new group is one line in `reference`.
module swage_input_reference
  use swage_case, only: explain_job, explain_mesh, explain_output, explain_solver, explain_step
  use swage_checkpoint, only: explain_restart
  use swage_flow_stress_registry, only: explain_flow_stress, flow_stress_names
  use swage_friction_registry, only: explain_friction, friction_names
  use swage_group, only: group_for_explaining, group_t, option_t
  use swage_material_registry, only: explain_material, material_names
  use swage_mechanics, only: mechanics_explain
  use swage_motion, only: explain_motion
  use swage_option_table, only: explain_text
  use swage_rigid_tool, only: explain_tool
  use swage_shape_registry, only: shape_names
  use swage_tool_control, only: control_kinds, explain_control
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: group_kinds, explain_all_groups, explain_group, GROUP_KIND_LENGTH

  !> Longest name of a group or of a variant of it.
  integer, parameter :: GROUP_KIND_LENGTH = 32

  character(len=1), parameter :: LINE_FEED = achar(10)

  abstract interface
    !> Record the keys of a group made for explaining.
    subroutine explain_keys(group)
      import :: group_t
      implicit none(type, external)
      type(group_t), intent(inout) :: group
    end subroutine explain_keys

    !> The same for one variant of it, or, when `variant` is none, the keys that all share.
    subroutine explain_variant(variant, group)
      import :: group_t
      implicit none(type, external)
      character(len=*), intent(in) :: variant
      type(group_t), intent(inout) :: group
    end subroutine explain_variant

    !> Names of the variants.
    function list_variants() result(names)
      import :: GROUP_KIND_LENGTH
      implicit none(type, external)
      character(len=GROUP_KIND_LENGTH), allocatable :: names(:)
    end function list_variants
  end interface

  !> One kind of group.
  type :: entry_t
    character(len=GROUP_KIND_LENGTH) :: kind = ''
    !> One sentence.
    character(len=128) :: purpose = ''
    !> Whether groups of this kind have names and may repeat.
    logical :: named = .false.
    !> Of a group whose keys are always the same; null for one with variants.
    procedure(explain_keys), pointer, nopass :: explain => null()
    !> Key that chooses the variant, and what it may be.
    character(len=GROUP_KIND_LENGTH) :: chooser = ''
    procedure(explain_variant), pointer, nopass :: explain_one => null()
    procedure(list_variants), pointer, nopass :: variants => null()
  end type entry_t

contains

  !> The only place where the groups are listed.
  function reference() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('job', 'What is computed, and in which units.', .false., explain_job), &
      entry_t('mesh', 'The mesh of all bodies.', .false., explain_mesh), &
      entry_t('body', 'Cells of the mesh and the material they are made of.', .true., &
              explain_body), &
      entry_t('interface', 'How two bodies of the mesh meet.', .true., explain_interface), &
      entry_t('material', 'A constitutive law and its parameters.', .true., null(), 'law', &
              explain_material, material_names), &
      entry_t('flow_stress', 'How the yield stress of a material depends on its history.', &
              .true., null(), 'kind', explain_flow_stress, flow_stress_names), &
      entry_t('boundary', 'What is imposed on a part of the surface, tools apart.', .true., &
              explain_boundary), &
      entry_t('tool', 'A rigid tool.', .true., null(), 'shape', explain_tool, shape_names), &
      entry_t('motion', 'How a tool moves.', .true., explain_motion), &
      entry_t('control', 'A coordinate of a tool that follows from forces.', .true., null(), &
              'kind', explain_control, control_kinds), &
      entry_t('friction', 'A friction law.', .true., null(), 'kind', explain_friction, &
              friction_names), &
      entry_t('contact', 'Which body may touch which tool, and how they rub.', .true., &
              explain_contact), &
      entry_t('step', 'A part of the run and its increments of time.', .true., explain_step), &
      entry_t('solver', 'How accurately and how the equations are solved.', .false., &
              explain_solver), &
      entry_t('output', 'What is written, where, and how often.', .false., explain_output), &
      entry_t('restart', 'When a run saves itself to go on later, and from what it goes on.', &
              .false., explain_restart)]

  end function reference

  !> Names of all groups, in the order of the table.
  function group_kinds() result(kinds)
    character(len=GROUP_KIND_LENGTH), allocatable :: kinds(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=reference())
    allocate (kinds(size(entries)))
    do i = 1, size(entries)
      kinds(i) = entries(i)%kind
    end do

  end function group_kinds

  !> A page that names all groups, with lines ended by line feeds.
  function explain_all_groups() result(page)
    character(len=:), allocatable :: page

    type(entry_t), allocatable :: entries(:)
    integer :: i, width

    allocate (entries, source=reference())
    width = maxval(len_trim(entries%kind)) + 2
    page = 'Groups of an input file; swage --explain GROUP lists the keys of one.'//LINE_FEED
    do i = 1, size(entries)
      associate (entry => entries(i))
        page = page//'  &'//entry%kind(:width)//trim(entry%purpose)
        if (entry%named) page = page//' May repeat.'
        page = page//LINE_FEED
      end associate
    end do

  end function explain_all_groups

  !> A page about one group: its keys, and those of each of its variants.
  subroutine explain_group(kind, page, status)
    !> As `material`; a leading `&` does not matter.
    character(len=*), intent(in) :: kind
    character(len=:), allocatable, intent(out) :: page
    !> `STATUS_ERROR` when there is no such group: lists those there are.
    type(status_t), intent(inout) :: status

    character(len=GROUP_KIND_LENGTH), allocatable :: variants(:)
    type(entry_t), allocatable :: entries(:)
    type(group_t) :: common, group
    type(option_t), allocatable :: options(:)
    procedure(list_variants), pointer :: list
    character(len=:), allocatable :: purpose
    integer :: i, place

    allocate (entries, source=reference())
    page = ''
    place = findloc(entries%kind == kind(merge(2, 1, index(kind, '&') == 1):), .true., dim=1)
    if (place == 0) then
      call status%raise(STATUS_ERROR, 'explain_group', 'there is no group &'//trim(kind)// &
                        did_you_mean(kind, group_kinds())//' Groups: '// &
                        listed(group_kinds(), ', ', ''))
      return
    end if

    associate (entry => entries(place))
      common = group_for_explaining(trim(entry%kind), entry%named)
      if (associated(entry%explain)) then
        call entry%explain(common)
        page = explain_text(trim(entry%kind), trim(entry%purpose), common%table())
        return
      end if
      call entry%explain_one('', common)
      page = explain_text(trim(entry%kind), trim(entry%purpose), common%table())

      ! Workaround: gfortran 12, internal error when a component is called here
      list => entry%variants
      allocate (variants, source=list())
      do i = 1, size(variants)
        group = group_for_explaining(trim(entry%kind), entry%named)
        call entry%explain_one(trim(variants(i)), group)
        call keep_other_options(group%table(), common%table(), options)
        purpose = 'Keys besides those above.'
        if (size(options) == 0) purpose = 'No keys besides those above.'
        page = page//LINE_FEED//explain_text(trim(entry%kind)//' '//trim(entry%chooser)// &
                                             ' = '''//trim(variants(i))//'''', purpose, options)
      end do
    end associate

  end subroutine explain_group

  !> The options of a table that another one does not have.
  subroutine keep_other_options(options, others, kept)
    type(option_t), intent(in) :: options(:)
    type(option_t), intent(in) :: others(:)
    type(option_t), allocatable, intent(out) :: kept(:)

    integer :: i, j, n
    logical :: is_other(size(options))

    do i = 1, size(options)
      is_other(i) = .true.
      do j = 1, size(others)
        if (others(j)%key == options(i)%key) is_other(i) = .false.
      end do
    end do
    allocate (kept(count(is_other)))
    n = 0
    do i = 1, size(options)
      if (.not. is_other(i)) cycle
      n = n + 1
      kept(n) = options(i)
    end do

  end subroutine keep_other_options

  !> The keys of `&body`; those below do the same.
  subroutine explain_body(group)
    type(group_t), intent(inout) :: group

    call mechanics_explain('body', group)

  end subroutine explain_body

  subroutine explain_interface(group)
    type(group_t), intent(inout) :: group

    call mechanics_explain('interface', group)

  end subroutine explain_interface

  subroutine explain_boundary(group)
    type(group_t), intent(inout) :: group

    call mechanics_explain('boundary', group)

  end subroutine explain_boundary

  subroutine explain_contact(group)
    type(group_t), intent(inout) :: group

    call mechanics_explain('contact', group)

  end subroutine explain_contact

end module swage_input_reference
