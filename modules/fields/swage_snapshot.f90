!> The state of a run on its way into a restart file or out of it: named arrays, without a file.
!>
!> Whoever holds state that the next step needs has two bindings, in which each thing is named
!> once:
!>
!>     save(snapshot)           call snapshot%put('pressure', self%pressure, OF_NODES)
!>     load(snapshot, status)   call snapshot%get('pressure', self%pressure, status, OF_NODES)
!>
!> An array belongs to a scope, which says how its last extent is spread over the ranks; other
!> extents are components. What belongs to nodes and cells goes by their numbers in the mesh, so
!> that another number of ranks can load it. Values come back with the bits that were saved.
!> Names are unique among all objects: one that exists several times writes its own name into them,
!> as in `contact die: traction`.
module swage_snapshot
  use swage_kinds, only: gp, wp
  use swage_sort, only: find_sorted, sorting_order
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: snapshot_t, snapshot_create, snapshot_entry_t, ENTRY_NAME_LENGTH
  public :: OF_RUN, OF_NODES, OF_CELLS, OF_SOME_NODES, OF_RANK
  public :: ENTRY_REALS, ENTRY_INTEGERS, ENTRY_TEXT

  !> The same on all ranks: counters, sums, settings. The scope of what is given without one.
  integer, parameter :: OF_RUN = 1
  !> One column for each local node of the mesh, the same on all its copies.
  integer, parameter :: OF_NODES = 2
  !> One column for each local cell.
  integer, parameter :: OF_CELLS = 3
  !> One column for each of some nodes, of which each is given by one rank, as those of a surface.
  integer, parameter :: OF_SOME_NODES = 4
  !> This rank's alone, in the order of its part of the mesh: lost when the number of ranks changes.
  !> Only for what makes a run faster or repeatable, and can be done without.
  integer, parameter :: OF_RANK = 5

  !> What an entry holds; logical values are integers 0 and 1.
  integer, parameter :: ENTRY_REALS = 1
  integer, parameter :: ENTRY_INTEGERS = 2
  integer, parameter :: ENTRY_TEXT = 3

  !> Longest name of an entry.
  integer, parameter :: ENTRY_NAME_LENGTH = 192

  !> One array, column after column.
  type :: snapshot_entry_t
    character(len=ENTRY_NAME_LENGTH) :: name = ''
    !> `OF_RUN` and its like.
    integer :: scope = OF_RUN
    !> `ENTRY_REALS` and its like.
    integer :: kind = ENTRY_REALS
    !> Numbers in a column.
    integer :: n_component = 1
    !> Columns on this rank.
    integer :: n_column = 0
    !> Shape (n_component * n_column).
    real(wp), allocatable :: reals(:)
    integer(gp), allocatable :: integers(:)
    !> A text `OF_RUN`.
    character(len=:), allocatable :: string
    !> Of `OF_SOME_NODES`: numbers of the nodes in the mesh; shape (n_column). From a file the
    !> columns of all ranks are there.
    integer(gp), allocatable :: key(:)
  end type snapshot_entry_t

  !> A property of the case that a restart must find unchanged.
  type :: property_t
    character(len=ENTRY_NAME_LENGTH) :: name = ''
    character(len=:), allocatable :: value
  end type property_t

  type :: snapshot_t
    !> Entries in use: `entries(:n_entry)`.
    integer :: n_entry = 0
    type(snapshot_entry_t), allocatable :: entries(:)
    !> Nodes that this rank owns; they come first.
    integer :: n_own_node = 0
    !> Numbers of the local nodes and cells in the mesh, unique; shapes (n_node), (n_cell).
    integer(gp), allocatable :: node_key(:), cell_key(:)
    !> What the case is, in use: `properties(:n_property)`.
    integer :: n_property = 0
    type(property_t), allocatable :: properties(:)
  contains
    !> Save a copy of a scalar or an array.
    generic :: put => put_real_0, put_real_1, put_real_2, put_real_3, put_integer_0, &
      put_integer_1, put_long_0, put_long_1, put_logical_0, &
      put_logical_1, put_text
    !> Load what was saved under a name, in the same shape.
    generic :: get => get_real_0, get_real_1, get_real_2, get_real_3, get_integer_0, &
      get_integer_1, get_long_0, get_long_1, get_logical_0, &
      get_logical_1, get_text
    !> Place of an entry, 0 when there is none of this name.
    procedure :: find => snapshot_find
    !> True when there is an entry of this name.
    procedure :: has => snapshot_has
    !> Numbers that this rank holds of an entry, 0 when there is none of this name.
    procedure :: count => snapshot_count
    !> State a property of the case that must not change before a restart.
    procedure :: identify => snapshot_identify
    !> First property that is not that of another snapshot, in words; empty when all agree.
    procedure :: difference => snapshot_difference
    !> Room for a new entry, for whoever reads a file.
    procedure :: append => snapshot_append
    procedure, private :: put_real_0
    procedure, private :: put_real_1
    procedure, private :: put_real_2
    procedure, private :: put_real_3
    procedure, private :: put_integer_0
    procedure, private :: put_integer_1
    procedure, private :: put_long_0
    procedure, private :: put_long_1
    procedure, private :: put_logical_0
    procedure, private :: put_logical_1
    procedure, private :: put_text
    procedure, private :: get_real_0
    procedure, private :: get_real_1
    procedure, private :: get_real_2
    procedure, private :: get_real_3
    procedure, private :: get_integer_0
    procedure, private :: get_integer_1
    procedure, private :: get_long_0
    procedure, private :: get_long_1
    procedure, private :: get_logical_0
    procedure, private :: get_logical_1
    procedure, private :: get_text
  end type snapshot_t

contains

  !> A snapshot without entries.
  pure subroutine snapshot_create(n_own_node, node_key, cell_key, snapshot)
    !> Nodes that this rank owns; they come first.
    integer, intent(in) :: n_own_node
    !> Numbers of the local nodes in the mesh, unique over the ranks; shape (n_node).
    integer(gp), intent(in) :: node_key(:)
    !> Numbers of the cells likewise; shape (n_cell).
    integer(gp), intent(in) :: cell_key(:)
    type(snapshot_t), intent(out) :: snapshot

    allocate (snapshot%entries(0), snapshot%properties(0))
    snapshot%n_own_node = n_own_node
    allocate (snapshot%node_key, source=node_key)
    allocate (snapshot%cell_key, source=cell_key)

  end subroutine snapshot_create

  pure function snapshot_find(self, name) result(place)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: place

    do place = self%n_entry, 1, -1
      if (self%entries(place)%name == without_slash(name)) exit
    end do

  end function snapshot_find

  !> A name as files can hold it, in which a slash would part a group from its member.
  pure function without_slash(name) result(clean)
    character(len=*), intent(in) :: name
    character(len=len_trim(name)) :: clean

    integer :: i

    clean = name
    do i = 1, len(clean)
      if (clean(i:i) == '/') clean(i:i) = '|'
    end do

  end function without_slash

  pure function snapshot_has(self, name) result(has)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    logical :: has

    has = self%find(name) > 0

  end function snapshot_has

  pure function snapshot_count(self, name) result(n)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: n

    integer :: place

    n = 0
    place = self%find(name)
    if (place > 0) n = self%entries(place)%n_component * self%entries(place)%n_column

  end function snapshot_count

  pure subroutine snapshot_identify(self, name, value)
    class(snapshot_t), intent(inout) :: self
    !> What a message calls it: `tools`.
    character(len=*), intent(in) :: name
    !> The same on all ranks.
    character(len=*), intent(in) :: value

    type(property_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(self%n_property + 1))
    do i = 1, self%n_property
      longer(i) = self%properties(i)
    end do
    call move_alloc(longer, self%properties)
    self%n_property = self%n_property + 1
    self%properties(self%n_property)%name = name
    self%properties(self%n_property)%value = value

  end subroutine snapshot_identify

  pure function snapshot_difference(self, other) result(words)
    class(snapshot_t), intent(in) :: self
    !> The case in hand.
    type(snapshot_t), intent(in) :: other
    character(len=:), allocatable :: words

    character(len=:), allocatable :: here, there
    integer :: i

    words = ''
    do i = 1, other%n_property
      here = other%properties(i)%value
      call value_of(self, other%properties(i)%name, there)
      if (here == there .and. len(here) == len(there)) cycle
      words = trim(other%properties(i)%name)//': '''//there//''' there, '''//here//''' here'
      return
    end do

  end function snapshot_difference

  !> A property, empty when there is none of this name.
  pure subroutine value_of(self, name, value)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: value

    integer :: i

    value = ''
    do i = 1, self%n_property
      if (self%properties(i)%name == name) value = self%properties(i)%value
    end do

  end subroutine value_of

  !> The entry is the last of the list, and still empty.
  pure subroutine snapshot_append(self, name, scope, kind)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: scope
    integer, intent(in) :: kind

    type(snapshot_entry_t), allocatable :: longer(:)
    integer :: i

    if (self%n_entry == size(self%entries)) then
      allocate (longer(2 * self%n_entry + 16))
      do i = 1, self%n_entry
        call move_entry(self%entries(i), longer(i))
      end do
      call move_alloc(longer, self%entries)
    end if
    self%n_entry = self%n_entry + 1
    self%entries(self%n_entry)%name = without_slash(name)
    self%entries(self%n_entry)%scope = scope
    self%entries(self%n_entry)%kind = kind

  end subroutine snapshot_append

  !> Hand over an entry without a copy of its numbers.
  pure subroutine move_entry(from, to)
    type(snapshot_entry_t), intent(inout) :: from
    type(snapshot_entry_t), intent(inout) :: to

    to%name = from%name
    to%scope = from%scope
    to%kind = from%kind
    to%n_component = from%n_component
    to%n_column = from%n_column
    call move_alloc(from%reals, to%reals)
    call move_alloc(from%integers, to%integers)
    call move_alloc(from%string, to%string)
    call move_alloc(from%key, to%key)

  end subroutine move_entry

  !> A new entry of reals.
  pure subroutine put_reals(self, name, values, n_column, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> All numbers.
    real(wp), intent(in) :: values(:)
    !> Extent of the last dimension.
    integer, intent(in) :: n_column
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call self%append(name, scope_of(scope), ENTRY_REALS)
    associate (entry => self%entries(self%n_entry))
      entry%n_column = n_column
      entry%n_component = size(values) / max(1, n_column)
      allocate (entry%reals, source=values)
    end associate
    if (present(node)) call put_keys(self, node)

  end subroutine put_reals

  !> The same for integers.
  pure subroutine put_integers(self, name, values, n_column, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(in) :: values(:)
    integer, intent(in) :: n_column
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call self%append(name, scope_of(scope), ENTRY_INTEGERS)
    associate (entry => self%entries(self%n_entry))
      entry%n_column = n_column
      entry%n_component = size(values) / max(1, n_column)
      allocate (entry%integers, source=values)
    end associate
    if (present(node)) call put_keys(self, node)

  end subroutine put_integers

  !> Numbers of the nodes of the last entry.
  pure subroutine put_keys(self, node)
    class(snapshot_t), intent(inout) :: self
    integer, intent(in) :: node(:)

    ! Workaround: gfortran 12, an array allocated with such a source starts at 0
    allocate (self%entries(self%n_entry)%key(size(node)))
    self%entries(self%n_entry)%key = self%node_key(node)

  end subroutine put_keys

  pure function scope_of(scope) result(known)
    integer, intent(in), optional :: scope
    integer :: known

    known = OF_RUN
    if (present(scope)) known = scope

  end function scope_of

  !> Columns of an entry that an array of this rank wants.
  pure subroutine choose_columns(self, name, kind, n_wanted, n_column, columns, place, status, &
                                 scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: kind
    !> Numbers and columns of the array.
    integer, intent(in) :: n_wanted
    integer, intent(in) :: n_column
    !> Shape (n_column).
    integer, allocatable, intent(out) :: columns(:)
    !> Of the entry.
    integer, intent(out) :: place
    !> `STATUS_ERROR` with `EXIT_FILE` when the entry is not there or does not fit.
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    !> Local nodes.
    integer, intent(in), optional :: node(:)

    character(len=:), allocatable :: fault
    integer(gp), allocatable :: keys(:)
    integer, allocatable :: order(:)
    integer :: i, n_component

    allocate (columns(n_column))
    columns = [(i, i=1, n_column)]
    fault = ''
    place = self%find(name)
    if (place == 0) then
      fault = 'is missing'
    else
      associate (entry => self%entries(place))
        n_component = n_wanted / max(1, n_column)
        if (entry%kind /= kind .or. entry%scope /= scope_of(scope)) then
          fault = 'is of another kind'
        else if (n_column > 0 .and. entry%n_component /= n_component) then
          fault = 'has '//text(entry%n_component)//' components, not '//text(n_component)
        else if (present(node)) then
          allocate (order, source=sorting_order(entry%key))
          allocate (keys(size(order)))
          keys = entry%key(order)
          do i = 1, n_column
            columns(i) = find_sorted(keys, self%node_key(node(i)))
            if (columns(i) == 0) then
              fault = 'does not know node '//text(int(self%node_key(node(i))))
              exit
            end if
            columns(i) = order(columns(i))
          end do
        else if (entry%n_column /= n_column) then
          fault = 'has '//text(entry%n_column)//' columns, not '//text(n_column)
        end if
      end associate
    end if
    if (fault /= '') then
      call status%raise(STATUS_ERROR, 'snapshot_get', ''''//trim(name)//''' '//fault, EXIT_FILE)
    end if

  end subroutine choose_columns

  !> All numbers of an entry that an array of reals wants.
  pure subroutine get_reals(self, name, values, n_column, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: values(:)
    integer, intent(in) :: n_column
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    integer, allocatable :: columns(:)
    integer :: i, n, place

    call choose_columns(self, name, ENTRY_REALS, size(values), n_column, columns, place, status, &
                        scope, node)
    if (status%failed()) return
    associate (entry => self%entries(place))
      n = entry%n_component
      do i = 1, n_column
        values((i - 1) * n + 1:i * n) = entry%reals((columns(i) - 1) * n + 1:columns(i) * n)
      end do
    end associate

  end subroutine get_reals

  !> The same for integers.
  pure subroutine get_integers(self, name, values, n_column, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(inout) :: values(:)
    integer, intent(in) :: n_column
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    integer, allocatable :: columns(:)
    integer :: i, n, place

    call choose_columns(self, name, ENTRY_INTEGERS, size(values), n_column, columns, place, &
                        status, scope, node)
    if (status%failed()) return
    associate (entry => self%entries(place))
      n = entry%n_component
      do i = 1, n_column
        values((i - 1) * n + 1:i * n) = entry%integers((columns(i) - 1) * n + 1:columns(i) * n)
      end do
    end associate

  end subroutine get_integers

  pure subroutine put_real_0(self, name, values)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: values

    call put_reals(self, name, [values], 1)

  end subroutine put_real_0

  pure subroutine put_real_1(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: values(:)
    !> `OF_RUN` when absent.
    integer, intent(in), optional :: scope
    !> Local nodes of the columns, for `OF_SOME_NODES`.
    integer, intent(in), optional :: node(:)

    call put_reals(self, name, values, size(values, 1), scope, node)

  end subroutine put_real_1

  pure subroutine put_real_2(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: values(:, :)
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call put_reals(self, name, reshape(values, [size(values)]), size(values, 2), scope, node)

  end subroutine put_real_2

  pure subroutine put_real_3(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: values(:, :, :)
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call put_reals(self, name, reshape(values, [size(values)]), size(values, 3), scope, node)

  end subroutine put_real_3

  pure subroutine put_integer_0(self, name, values)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: values

    call put_integers(self, name, int([values], gp), 1)

  end subroutine put_integer_0

  pure subroutine put_integer_1(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: values(:)
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call put_integers(self, name, int(values, gp), size(values, 1), scope, node)

  end subroutine put_integer_1

  pure subroutine put_long_0(self, name, values)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(in) :: values

    call put_integers(self, name, [values], 1)

  end subroutine put_long_0

  pure subroutine put_long_1(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(in) :: values(:)
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call put_integers(self, name, values, size(values, 1), scope, node)

  end subroutine put_long_1

  pure subroutine put_logical_0(self, name, values)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    logical, intent(in) :: values

    call put_integers(self, name, merge(1_gp, 0_gp, [values]), 1)

  end subroutine put_logical_0

  pure subroutine put_logical_1(self, name, values, scope, node)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    logical, intent(in) :: values(:)
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    call put_integers(self, name, merge(1_gp, 0_gp, values), size(values, 1), scope, node)

  end subroutine put_logical_1

  pure subroutine get_real_0(self, name, values, status)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: values
    !> `STATUS_ERROR` with `EXIT_FILE` on this rank when there is no such entry, or it has another
    !> kind or shape; `values` are then left alone.
    type(status_t), intent(inout) :: status

    real(wp) :: buffer(1)

    call get_reals(self, name, buffer, 1, status)
    if (.not. status%failed()) values = buffer(1)

  end subroutine get_real_0

  pure subroutine get_real_1(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: values(:)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    real(wp) :: buffer(size(values))

    call get_reals(self, name, buffer, size(values, 1), status, scope, node)
    if (.not. status%failed()) values = buffer

  end subroutine get_real_1

  pure subroutine get_real_2(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: values(:, :)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    real(wp) :: buffer(size(values))

    call get_reals(self, name, buffer, size(values, 2), status, scope, node)
    if (.not. status%failed()) values = reshape(buffer, shape(values))

  end subroutine get_real_2

  pure subroutine get_real_3(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(inout) :: values(:, :, :)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    real(wp) :: buffer(size(values))

    call get_reals(self, name, buffer, size(values, 3), status, scope, node)
    if (.not. status%failed()) values = reshape(buffer, shape(values))

  end subroutine get_real_3

  pure subroutine get_integer_0(self, name, values, status)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(inout) :: values
    type(status_t), intent(inout) :: status

    integer(gp) :: buffer(1)

    call get_integers(self, name, buffer, 1, status)
    if (.not. status%failed()) values = int(buffer(1))

  end subroutine get_integer_0

  pure subroutine get_integer_1(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(inout) :: values(:)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    integer(gp) :: buffer(size(values))

    call get_integers(self, name, buffer, size(values, 1), status, scope, node)
    if (.not. status%failed()) values = int(buffer)

  end subroutine get_integer_1

  pure subroutine get_long_0(self, name, values, status)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(inout) :: values
    type(status_t), intent(inout) :: status

    integer(gp) :: buffer(1)

    call get_integers(self, name, buffer, 1, status)
    if (.not. status%failed()) values = buffer(1)

  end subroutine get_long_0

  pure subroutine get_long_1(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer(gp), intent(inout) :: values(:)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    integer(gp) :: buffer(size(values))

    call get_integers(self, name, buffer, size(values, 1), status, scope, node)
    if (.not. status%failed()) values = buffer

  end subroutine get_long_1

  pure subroutine get_logical_0(self, name, values, status)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    logical, intent(inout) :: values
    type(status_t), intent(inout) :: status

    integer(gp) :: buffer(1)

    call get_integers(self, name, buffer, 1, status)
    if (.not. status%failed()) values = buffer(1) /= 0_gp

  end subroutine get_logical_0

  pure subroutine get_logical_1(self, name, values, status, scope, node)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    logical, intent(inout) :: values(:)
    type(status_t), intent(inout) :: status
    integer, intent(in), optional :: scope
    integer, intent(in), optional :: node(:)

    integer(gp) :: buffer(size(values))

    call get_integers(self, name, buffer, size(values, 1), status, scope, node)
    if (.not. status%failed()) values = buffer /= 0_gp

  end subroutine get_logical_1

  pure subroutine put_text(self, name, string)
    class(snapshot_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Without trailing blanks.
    character(len=*), intent(in) :: string

    call self%append(name, OF_RUN, ENTRY_TEXT)
    self%entries(self%n_entry)%string = trim(string)

  end subroutine put_text

  pure subroutine get_text(self, name, string, status)
    class(snapshot_t), intent(in) :: self
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(inout) :: string
    type(status_t), intent(inout) :: status

    integer, allocatable :: columns(:)
    integer :: place

    call choose_columns(self, name, ENTRY_TEXT, 0, 0, columns, place, status)
    if (.not. status%failed()) string = self%entries(place)%string

  end subroutine get_text

end module swage_snapshot
