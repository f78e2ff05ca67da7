!> Input decks: the groups of a namelist file, identical on every rank.
module swage_deck
  use, intrinsic :: iso_fortran_env, only: int64
  use swage_comm, only: comm_t
  use swage_group, only: group_create, group_t, NAME_LENGTH
  use swage_namelist, only: namelist_group_t, namelist_parse, position_text
  use swage_path, only: describe_unreadable
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: deck_t, deck_load, deck_from_text

  !> The file travels between ranks as text and is parsed by each of them, so no value can be
  !> forgotten in a broadcast. Groups of one kind may repeat, in any order, and are told apart by
  !> their `name`, which is unique among them; one without gets `kind_N`, N its place.
  type :: deck_t
    !> The file, as the user named it.
    character(len=:), allocatable :: path
    !> Its folder, ended by `/`: paths in the file start here. See `resolve`.
    character(len=:), allocatable :: folder
    type(group_t), allocatable, private :: groups(:)
  contains
    !> Number of groups of a kind.
    procedure :: count => deck_count
    !> A group by its place among those of its kind.
    procedure :: get => deck_get
    !> The group of a kind that comes at most once and has no name.
    procedure :: get_only => deck_get_only
    !> A group by its name.
    procedure :: find => deck_find
    !> Refuse groups of a kind that nobody knows.
    procedure :: check_kinds => deck_check_kinds
    !> A path given in the file, as seen from where the program runs.
    procedure :: resolve => deck_resolve
    !> Start of a message about the first key that gives a path; empty when none does.
    procedure :: describe_path => deck_describe_path
    procedure, private :: list_names => deck_list_names
    procedure, private :: place => deck_place
  end type deck_t

contains

  !> Collective. Rank 0 reads the file, all ranks receive its text.
  subroutine deck_load(path, comm, deck, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(deck_t), intent(out) :: deck
    !> `STATUS_ERROR`, the same on all ranks, when the file cannot be read or breaks the syntax.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: content

    if (comm%rank == 0) call read_file(path, content, status)
    call comm%agree(status)
    if (status%failed()) return

    call comm%broadcast(content)
    call deck_from_text(content, path, deck, status)

  end subroutine deck_load

  !> The deck that a text makes.
  pure subroutine deck_from_text(content, path, deck, status)
    !> Lines ended by line feeds.
    character(len=*), intent(in) :: content
    !> Named in messages; need not exist.
    character(len=*), intent(in) :: path
    type(deck_t), intent(out) :: deck
    !> `STATUS_ERROR` with path and line when the text breaks the syntax or a name comes twice.
    type(status_t), intent(inout) :: status

    type(namelist_group_t), allocatable :: sources(:)
    integer :: i

    deck%path = path
    deck%folder = path(:index(path, '/', back=.true.))
    if (deck%folder == '') deck%folder = './'
    allocate (deck%groups(0))
    call namelist_parse(content, path, sources, status)
    if (status%failed()) return
    if (size(sources) == 0) then
      call status%raise(STATUS_ERROR, 'deck_from_text', path//': holds no group; an input file '// &
                        'consists of groups &kind key = value ... /')
      return
    end if

    deallocate (deck%groups)
    allocate (deck%groups(size(sources)))
    do i = 1, size(sources)
      deck%groups(i) = group_create(sources(i), path)
    end do
    call name_groups(deck%groups, status)

  end subroutine deck_from_text

  pure function deck_count(self, kind) result(n_group)
    class(deck_t), intent(in) :: self
    !> In lower case, as `material`.
    character(len=*), intent(in) :: kind
    integer :: n_group

    integer :: i

    n_group = 0
    do i = 1, size(self%groups)
      if (self%groups(i)%kind == kind) n_group = n_group + 1
    end do

  end function deck_count

  !> The key `name` has been taken.
  pure subroutine deck_get(self, kind, i, group)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    !> 1 to `count(kind)`.
    integer, intent(in) :: i
    type(group_t), intent(out) :: group

    character(len=:), allocatable :: name

    group = self%groups(self%place(kind, i))
    name = group%name
    call group%take('name', name, 'Name by which other groups and the results refer to this one.')

  end subroutine deck_get

  !> A group without keys when the file has none of the kind, so that defaults and complaints about
  !> missing keys arise in one place. A `name` in it is an unknown key.
  pure subroutine deck_get_only(self, kind, group, status)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    type(group_t), intent(out) :: group
    !> `STATUS_ERROR` when the kind comes more than once.
    type(status_t), intent(inout) :: status

    type(namelist_group_t) :: absent

    if (self%count(kind) == 0) then
      absent%kind = kind
      allocate (absent%entries(0))
      group = group_create(absent, self%path)
      return
    end if
    group = self%groups(self%place(kind, 1))
    call group%set_name('')
    if (self%count(kind) == 1) return
    associate (second => self%groups(self%place(kind, 2)))
      call status%raise(STATUS_ERROR, 'deck_get_only', position_text(self%path, second%line)// &
                        ' &'//kind//': given twice, first in line '//text(group%line)// &
                        '; this group may come only once')
    end associate

  end subroutine deck_get_only

  !> The key `name` has been taken.
  pure subroutine deck_find(self, kind, name, group, status, from, key)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    character(len=*), intent(in) :: name
    type(group_t), intent(out) :: group
    !> `STATUS_ERROR` when there is no such group: lists those there are.
    type(status_t), intent(inout) :: status
    !> The group that refers to the name by its key `key`: lets the message name its line.
    type(group_t), intent(in), optional :: from
    character(len=*), intent(in), optional :: key

    character(len=:), allocatable :: start
    character(len=NAME_LENGTH), allocatable :: known(:)
    integer :: i

    do i = 1, self%count(kind)
      if (self%groups(self%place(kind, i))%name /= name) cycle
      call self%get(kind, i, group)
      return
    end do

    start = self%path//': '
    if (present(from) .and. present(key)) start = from%describe(key)//': '
    start = start//'there is no &'//kind//' named '''//name//''''
    if (self%count(kind) == 0) then
      call status%raise(STATUS_ERROR, 'deck_find', start//'; the file has no &'//kind)
      return
    end if
    call self%list_names(kind, known)
    call status%raise(STATUS_ERROR, 'deck_find', start//did_you_mean(name, known)// &
                      ' Known names: '//listed(known, ', ', ''''))

  end subroutine deck_find

  !> Call it before anything is read: a misspelt group would otherwise seem to be missing.
  pure subroutine deck_check_kinds(self, known, status)
    class(deck_t), intent(in) :: self
    !> All kinds there are.
    character(len=*), intent(in) :: known(:)
    !> `STATUS_ERROR` at the first group that is none of them.
    type(status_t), intent(inout) :: status

    integer :: i

    do i = 1, size(self%groups)
      associate (group => self%groups(i))
        if (any(known == group%kind)) cycle
        call status%raise(STATUS_ERROR, 'deck_check_kinds', &
                          position_text(self%path, group%line)//' unknown group &'// &
                          group%kind//did_you_mean(group%kind, known)//' Known groups: '// &
                          listed(known, ', ', ''))
        return
      end associate
    end do

  end subroutine deck_check_kinds

  !> Relative paths start at the folder of the file.
  pure function deck_resolve(self, path) result(resolved)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: resolved

    resolved = path
    if (index(path, '/') /= 1) resolved = self%folder//path

  end function deck_resolve

  pure function deck_describe_path(self, path) result(description)
    class(deck_t), intent(in) :: self
    !> As seen from where the program runs, as `resolve` gives it or without `./`.
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: description

    character(len=:), allocatable :: key, short
    integer :: i

    description = ''
    ! As the file may write it: from its folder on, or from the root
    if (index(path, self%folder) == 1) then
      short = path(len(self%folder) + 1:)
    else if (self%folder == './' .or. index(path, '/') == 1) then
      short = path
    else
      return
    end if
    do i = 1, size(self%groups)
      key = self%groups(i)%key_of(short)
      if (key == '') key = self%groups(i)%key_of('./'//short)
      if (key == '' .and. index(path, '/') == 1) key = self%groups(i)%key_of(path)
      if (key == '') cycle
      description = self%groups(i)%describe(key)
      return
    end do

  end function deck_describe_path

  !> The names of all groups of a kind.
  pure subroutine deck_list_names(self, kind, names)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    character(len=NAME_LENGTH), allocatable, intent(out) :: names(:)

    integer :: i

    allocate (names(self%count(kind)))
    do i = 1, size(names)
      names(i) = self%groups(self%place(kind, i))%name
    end do

  end subroutine deck_list_names

  !> Place in the file of the group that is the `i`-th of its kind.
  pure function deck_place(self, kind, i) result(place)
    class(deck_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    integer, intent(in) :: i
    integer :: place

    integer :: n_group

    n_group = 0
    do place = 1, size(self%groups)
      if (self%groups(place)%kind == kind) n_group = n_group + 1
      if (n_group == i) return
    end do

  end function deck_place

  !> Give each group the name in its key `name`, or `kind_N`.
  pure subroutine name_groups(groups, status)
    type(group_t), intent(inout) :: groups(:)
    !> `STATUS_ERROR` when a name is no text or comes twice.
    type(status_t), intent(inout) :: status

    type(group_t) :: reader
    character(len=:), allocatable :: name
    integer :: i, j, n_same

    do i = 1, size(groups)
      n_same = 0
      do j = 1, i
        if (groups(j)%kind == groups(i)%kind) n_same = n_same + 1
      end do
      name = groups(i)%kind//'_'//text(n_same)

      ! In a copy, so that the key counts as taken only where groups of this kind have names
      reader = groups(i)
      call reader%take('name', name, '')
      if (.not. reader%status%failed() .and. name == '') then
        call reader%refuse('name', 'must not be empty')
      end if
      if (len(name) > NAME_LENGTH) then
        call reader%refuse('name', 'must have at most '//text(NAME_LENGTH)//' characters')
      end if
      do j = 1, i - 1
        if (groups(j)%kind /= groups(i)%kind .or. groups(j)%name /= name) cycle
        call reader%refuse('name', 'the name '''//name//''' is taken by the &'// &
                           groups(j)%kind//' in line '//text(groups(j)%line))
      end do
      if (reader%status%failed()) then
        call status%raise(STATUS_ERROR, 'name_groups', reader%status%message)
        return
      end if
      call groups(i)%set_name(name)
    end do

  end subroutine name_groups

  !> All bytes of a file.
  subroutine read_file(path, content, status)
    character(len=*), intent(in) :: path
    character(len=:), allocatable, intent(out) :: content
    type(status_t), intent(inout) :: status

    character(len=256) :: reason
    integer :: code, unit
    integer(int64) :: n_byte

    content = ''
    open (newunit=unit, file=path, status='old', action='read', access='stream', &
          form='unformatted', iostat=code, iomsg=reason)
    if (code /= 0) then
      call status%raise(STATUS_ERROR, 'deck_load', trim(path)//': cannot be opened: '// &
                        describe_unreadable(path, reason))
      return
    end if

    inquire (unit=unit, size=n_byte)
    if (n_byte > 0) then
      deallocate (content)
      allocate (character(len=n_byte) :: content)
      read (unit, iostat=code, iomsg=reason) content
    end if
    if (code /= 0 .or. n_byte < 0) then
      call status%raise(STATUS_ERROR, 'deck_load', trim(path)//': cannot be read: '// &
                        describe_unreadable(path, reason))
    end if
    close (unit)

  end subroutine read_file

end module swage_deck
