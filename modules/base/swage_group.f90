!> One group of an input file, read key by key.
!>
!> A group is *taken from*: whoever owns a key names it once, with its dimension, meaning and
!> range, in one call of `take`. That call reads the key, keeps the default where it is absent,
!> turns degrees Celsius into kelvin and checks the range. Several owners may share a group, as a
!> material and its law do; what nobody has taken, `finish` refuses. The first fault waits in
!> `status`, so that all keys can be taken before anyone looks.
!>
!> Two other kinds of group serve the same calls: a group nobody has made (`type(group_t) ::
!> group`) only checks, so that values which come from no file pass through the same call; one
!> made for explaining only records what it is asked, the table that `--explain` prints.
module swage_group
  use swage_finite, only: is_finite
  use swage_kinds, only: wp
  use swage_namelist, only: entry_t, item_t, namelist_group_t, namelist_parse, position_text
  use swage_number, only: number_text, read_integer, read_logical, read_real
  use swage_option_table, only: option_t
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t, STATUS_ERROR
  use swage_text, only: text
  use swage_units, only: shown, taken
  implicit none(type, external)
  private

  public :: group_t, group_create, group_from_text, group_for_explaining, NAME_LENGTH
  ! What `table` returns
  public :: option_t

  !> Longest name in a list of texts.
  integer, parameter :: NAME_LENGTH = 64

  !> A number of values that is not prescribed.
  integer, parameter :: ANY_NUMBER = -1

  type :: group_t
    !> Start of a message about the whole group: `case.nml:12: &material 'steel'`.
    character(len=:), allocatable :: title
    !> As `material`.
    character(len=:), allocatable :: kind
    !> Set by the deck; empty in a group without a name.
    character(len=:), allocatable :: name
    !> Line of the `&`.
    integer :: line = 0
    !> True when the calls only record the table.
    logical :: explaining = .false.
    !> The first fault met; `finish` hands it on.
    type(status_t) :: status
    !> The file.
    character(len=:), allocatable, private :: path
    type(entry_t), allocatable, private :: entries(:)
    !> True for the entries that someone has taken.
    logical, allocatable, private :: is_taken(:)
    !> All keys asked for, in the order of the calls.
    type(option_t), allocatable, private :: options(:)
    !> The fault in `status` is a key that is absent, and perhaps only misspelt.
    logical, private :: misses_key = .false.
  contains
    !> Read and check one key: a real number, a fixed number of them, an integer, a logical value
    !> or a text.
    generic :: take => take_real, take_reals, take_integer, take_logical, take_text
    !> The same for a list of any length: reals or texts.
    generic :: take_list => take_real_list, take_text_list
    !> True when the file gives a key; this does not count as taking it.
    procedure :: given => group_given
    !> Refuse the value of a key for a reason its owner has found.
    procedure :: refuse => group_refuse
    !> Refuse the keys that nobody has taken, and hand on the first fault.
    procedure :: finish => group_finish
    !> The keys taken so far.
    procedure :: table => group_table
    !> Give the group its name, which appears in every message.
    procedure :: set_name => group_set_name
    !> Start of a message about a key: `case.nml:13: &material 'steel': young_modulus = -5`.
    procedure :: describe => group_describe
    !> The first key whose value is a text, empty when there is none.
    procedure :: key_of => group_key_of
    procedure, private :: take_real
    procedure, private :: take_reals
    procedure, private :: take_real_list
    procedure, private :: take_integer
    procedure, private :: take_logical
    procedure, private :: take_text
    procedure, private :: take_text_list
    procedure, private :: fault => group_fault
    procedure, private :: find => group_find
    procedure, private :: is_from_file => group_is_from_file
    procedure, private :: list_known_keys => group_list_known_keys
    procedure, private :: read_reals => group_read_reals
    procedure, private :: record => group_record
    procedure, private :: title_at => group_title_at
  end type group_t

contains

  !> A group to take from.
  pure function group_create(source, path) result(group)
    type(namelist_group_t), intent(in) :: source
    !> The file, for messages.
    character(len=*), intent(in) :: path
    type(group_t) :: group

    group%path = path
    group%kind = source%kind
    group%line = source%line
    allocate (group%entries(size(source%entries)))
    group%entries = source%entries
    allocate (group%is_taken(size(source%entries)))
    group%is_taken = .false.
    call group%set_name('')

  end function group_create

  !> The first group of a text; a group without keys when the text holds none.
  pure subroutine group_from_text(source, path, group, status)
    !> As `&material law = 'j2' /`.
    character(len=*), intent(in) :: source
    !> Named in messages.
    character(len=*), intent(in) :: path
    type(group_t), intent(out) :: group
    !> `STATUS_ERROR` when the text breaks the syntax.
    type(status_t), intent(inout) :: status

    type(namelist_group_t), allocatable :: groups(:)

    call namelist_parse(source, path, groups, status)
    if (status%failed()) return
    if (size(groups) == 0) then
      call status%raise(STATUS_ERROR, 'group_from_text', path//': holds no group')
      return
    end if
    group = group_create(groups(1), path)

  end subroutine group_from_text

  !> A group on which `take` only records what it is asked; values keep their defaults.
  pure function group_for_explaining(kind, named) result(group)
    !> As `material`.
    character(len=*), intent(in) :: kind
    !> True (the default) when groups of this kind have a `name`.
    logical, intent(in), optional :: named
    type(group_t) :: group

    group%explaining = .true.
    group%kind = kind
    call group%set_name('')
    if (present(named)) then
      if (.not. named) return
    end if
    call group%record('name', 'text', '', ''''//kind//'_1'', ...', '', '', &
                      'Name by which other groups and the results refer to this one.')

  end function group_for_explaining

  !> A real number. An absolute temperature, of dimension `temperature`, is in degrees Celsius in
  !> the file and in kelvin in `value`.
  pure subroutine take_real(self, key, value, dimension, meaning, above, below, lower, upper, &
                            required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default.
    real(wp), intent(inout) :: value
    character(len=*), intent(in) :: dimension
    !> One sentence.
    character(len=*), intent(in) :: meaning
    !> Range, in the units of `value`; `above` and `below` are open bounds.
    real(wp), intent(in), optional :: above, below, lower, upper
    !> Whether the key must be given; by default, when the default lies outside the range.
    logical, intent(in), optional :: required

    real(wp), allocatable :: values(:)

    allocate (values(1))
    values(1) = value
    call self%read_reals(key, values, 'real', 1, dimension, meaning, above, below, lower, upper, &
                         required)
    value = values(1)

  end subroutine take_real

  !> As many real numbers as `values` has; see `take_real`.
  pure subroutine take_reals(self, key, values, dimension, meaning, above, below, lower, upper, &
                             required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the defaults.
    real(wp), intent(inout) :: values(:)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: meaning
    real(wp), intent(in), optional :: above, below, lower, upper
    logical, intent(in), optional :: required

    real(wp), allocatable :: list(:)

    allocate (list(size(values)))
    list = values
    call self%read_reals(key, list, text(size(values))//' reals', size(values), dimension, &
                         meaning, above, below, lower, upper, required)
    values = list

  end subroutine take_reals

  !> Any number of real numbers, one at least when the key is given; see `take_real`.
  pure subroutine take_real_list(self, key, values, dimension, meaning, above, below, lower, &
                                 upper, required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default, empty when not allocated. Out: allocated.
    real(wp), allocatable, intent(inout) :: values(:)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: meaning
    real(wp), intent(in), optional :: above, below, lower, upper
    logical, intent(in), optional :: required

    if (.not. allocated(values)) allocate (values(0))
    call self%read_reals(key, values, 'reals', ANY_NUMBER, dimension, meaning, above, below, &
                         lower, upper, required)

  end subroutine take_real_list

  !> A whole number.
  pure subroutine take_integer(self, key, value, meaning, lower, upper, required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default.
    integer, intent(inout) :: value
    !> One sentence.
    character(len=*), intent(in) :: meaning
    integer, intent(in), optional :: lower, upper
    !> Whether the key must be given; by default, when the default lies outside the range.
    logical, intent(in), optional :: required

    character(len=:), allocatable :: complaint, default, range
    integer :: place
    logical :: must_be_given

    range = ''
    if (present(lower)) range = joined(range, 'at least '//text(lower))
    if (present(upper)) range = joined(range, 'at most '//text(upper))
    must_be_given = is_outside(value)
    if (present(required)) must_be_given = required
    default = text(value)
    if (must_be_given) default = 'required'
    call self%record(key, 'integer', '', default, range(min(3, len(range) + 1):), '', meaning)
    if (self%explaining) return

    call self%find(key, 1, 'a whole number', place)
    if (place < 0) return
    if (place == 0) then
      if (self%is_from_file() .and. must_be_given) then
        call self%fault(key, 'must be given, a whole number'//range)
      else if (.not. self%is_from_file() .and. is_outside(value)) then
        call self%fault(key, text(value)//': must be '//range(3:))
      end if
      return
    end if

    associate (item => self%entries(place)%items(1))
      complaint = 'must be a whole number'
      if (.not. item%quoted) call read_integer(item%text, value, complaint)
    end associate
    if (complaint /= '') then
      call self%fault(key, complaint//range)
    else if (is_outside(value)) then
      call self%fault(key, 'must be '//range(3:))
    end if

  contains

    pure function is_outside(number) result(outside)
      integer, intent(in) :: number
      logical :: outside

      outside = .false.
      if (present(lower)) outside = outside .or. number < lower
      if (present(upper)) outside = outside .or. number > upper

    end function is_outside

  end subroutine take_integer

  !> A logical value.
  pure subroutine take_logical(self, key, value, meaning)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default.
    logical, intent(inout) :: value
    !> One sentence.
    character(len=*), intent(in) :: meaning

    character(len=:), allocatable :: complaint, default
    integer :: place

    default = '.false.'
    if (value) default = '.true.'
    call self%record(key, 'logical', '', default, '', '', meaning)
    if (self%explaining) return

    call self%find(key, 1, '.true. or .false.', place)
    if (place < 1) return
    associate (item => self%entries(place)%items(1))
      complaint = 'must be .true. or .false., without quotes'
      if (.not. item%quoted) call read_logical(item%text, value, complaint)
    end associate
    if (complaint /= '') call self%fault(key, complaint)

  end subroutine take_logical

  !> A word, name or path, in quotes; case and inner blanks are kept.
  pure subroutine take_text(self, key, value, meaning, choices, required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default, empty when not allocated. Out: allocated.
    character(len=:), allocatable, intent(inout) :: value
    !> One sentence.
    character(len=*), intent(in) :: meaning
    !> The texts allowed; any when absent.
    character(len=*), intent(in), optional :: choices(:)
    !> Whether the key must be given; by default, when the default is not among the choices.
    logical, intent(in), optional :: required

    character(len=:), allocatable :: allowed, default, options
    integer :: place
    logical :: must_be_given

    if (.not. allocated(value)) value = ''
    must_be_given = .not. is_choice(value)
    if (present(required)) must_be_given = required
    allowed = ''
    options = ''
    if (present(choices)) then
      allowed = listed(choices, ', ', '''')
      options = listed(choices, ' | ', '''')
    end if
    default = ''''//value//''''
    if (value == '') default = 'none'
    if (must_be_given) default = 'required'
    call self%record(key, 'text', '', default, '', options, meaning)
    if (self%explaining) return

    call self%find(key, 1, 'one text in quotes', place)
    if (place < 0) return
    if (place == 0) then
      if (allowed /= '') allowed = ', one of '//allowed
      if (self%is_from_file() .and. must_be_given) then
        call self%fault(key, 'must be given, in quotes'//allowed)
      else if (.not. self%is_from_file() .and. value /= '' .and. .not. is_choice(value)) then
        call self%fault(key, ''''//value//''': must be'//allowed(2:))
      end if
      return
    end if

    associate (item => self%entries(place)%items(1))
      value = item%text
      if (.not. item%quoted) then
        call self%fault(key, 'must be a text in quotes: '''//item%text//'''')
      else if (.not. is_choice(item%text)) then
        call self%fault(key, 'is unknown'//did_you_mean(item%text, choices)//' Allowed: '//allowed)
      else if (item%text == '' .and. must_be_given) then
        call self%fault(key, 'must not be empty')
      end if
    end associate

  contains

    pure function is_choice(word) result(choice)
      character(len=*), intent(in) :: word
      logical :: choice

      choice = .true.
      if (present(choices)) choice = any(choices == word)

    end function is_choice

  end subroutine take_text

  !> Any number of names in quotes, one at least when the key is given.
  pure subroutine take_text_list(self, key, values, meaning, required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> In: the default, empty when not allocated. Out: allocated.
    character(len=NAME_LENGTH), allocatable, intent(inout) :: values(:)
    !> One sentence.
    character(len=*), intent(in) :: meaning
    !> Whether the key must be given; .false. when absent.
    logical, intent(in), optional :: required

    character(len=:), allocatable :: default
    integer :: i, place
    logical :: must_be_given

    if (.not. allocated(values)) allocate (values(0))
    must_be_given = .false.
    if (present(required)) must_be_given = required
    default = listed(values, ', ', '''')
    if (size(values) == 0) default = 'none'
    if (must_be_given) default = 'required'
    call self%record(key, 'texts', '', default, '', '', meaning)
    if (self%explaining) return

    call self%find(key, ANY_NUMBER, 'texts', place)
    if (place < 0) return
    if (place == 0) then
      if (self%is_from_file() .and. must_be_given) then
        call self%fault(key, 'must be given, texts in quotes')
      end if
      return
    end if

    deallocate (values)
    associate (items => self%entries(place)%items)
      allocate (values(size(items)))
      do i = 1, size(items)
        values(i) = items(i)%text
        if (.not. items(i)%quoted) then
          call self%fault(key, 'value '//text(i)//' must be a text in quotes: '''// &
                          items(i)%text//'''')
        else if (len(items(i)%text) > NAME_LENGTH) then
          call self%fault(key, 'value '//text(i)//' must have at most '//text(NAME_LENGTH)// &
                          ' characters, it has '//text(len(items(i)%text)))
        end if
      end do
    end associate

  end subroutine take_text_list

  pure function group_given(self, key) result(given)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    logical :: given

    given = place_of(self, key) > 0

  end function group_given

  !> The message names file, line, group, key and value, then the reason.
  pure subroutine group_refuse(self, key, why)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> What is wrong and what would be right.
    character(len=*), intent(in) :: why

    if (self%explaining) return
    call self%fault(key, why)

  end subroutine group_refuse

  !> Call it after the last `take`.
  pure subroutine group_finish(self, status)
    class(group_t), intent(inout) :: self
    !> `STATUS_ERROR` when a key is unknown, wrong or missing.
    type(status_t), intent(inout) :: status

    character(len=NAME_LENGTH), allocatable :: known(:)
    integer :: i

    if (self%explaining) return

    ! A wrong value may have kept an owner from taking the keys that depend on it, and a key that
    ! is missing may only be misspelt: so the unknown keys come between the two
    if (self%status%failed() .and. .not. self%misses_key) then
      call status%raise(self%status%severity, self%status%origin, self%status%message, &
                        self%status%exit_code)
    end if
    if (self%is_from_file()) then
      call self%list_known_keys(known)
      do i = 1, size(self%entries)
        if (self%is_taken(i)) cycle
        call status%raise(STATUS_ERROR, 'group_finish', self%title_at(self%entries(i)%line)// &
                          ': unknown key '''//self%entries(i)%key//''''// &
                          did_you_mean(self%entries(i)%key, known)// &
                          ' Known keys: '//listed(known, ', ', ''))
      end do
    end if
    if (self%status%failed()) then
      call status%raise(self%status%severity, self%status%origin, self%status%message, &
                        self%status%exit_code)
    end if

  end subroutine group_finish

  pure function group_table(self) result(options)
    class(group_t), intent(in) :: self
    !> In the order of the calls.
    type(option_t), allocatable :: options(:)

    integer :: n

    n = 0
    if (allocated(self%options)) n = size(self%options)
    allocate (options(n))
    if (n > 0) options = self%options

  end function group_table

  pure subroutine group_set_name(self, name)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: name

    self%name = name
    self%title = self%title_at(self%line)

  end subroutine group_set_name

  !> With the value as it is written; without, when the file does not give the key.
  pure function group_describe(self, key) result(description)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    character(len=:), allocatable :: description

    integer, parameter :: LONGEST = 120

    integer :: place

    place = place_of(self, key)
    if (place == 0) then
      description = self%title_at(self%line)//': '//key
      return
    end if
    associate (entry => self%entries(place))
      description = self%title_at(entry%line)//': '//key//' = '
      if (len(entry%written) > LONGEST) then
        description = description//entry%written(:LONGEST)//'...'
      else
        description = description//entry%written
      end if
    end associate

  end function group_describe

  pure function group_key_of(self, text) result(key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: key

    integer :: i

    key = ''
    do i = 1, size(self%entries)
      if (size(self%entries(i)%items) /= 1) cycle
      if (.not. self%entries(i)%items(1)%quoted) cycle
      if (self%entries(i)%items(1)%text /= text) cycle
      key = self%entries(i)%key
      return
    end do

  end function group_key_of

  !> The work of the three procedures that take reals.
  pure subroutine group_read_reals(self, key, values, type, n_value, dimension, meaning, above, &
                                   below, lower, upper, required)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), allocatable, intent(inout) :: values(:)
    !> For the table.
    character(len=*), intent(in) :: type
    !> Values to be given, or `ANY_NUMBER`.
    integer, intent(in) :: n_value
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: meaning
    real(wp), intent(in), optional :: above, below, lower, upper
    logical, intent(in), optional :: required

    character(len=:), allocatable :: complaint, default, range, unit, which
    real(wp), allocatable :: numbers(:)
    integer :: i, place
    logical :: must_be_given

    range = ''
    range = with_bound(range, 'above', above)
    range = with_bound(range, 'at least', lower)
    range = with_bound(range, 'below', below)
    range = with_bound(range, 'at most', upper)
    unit = ' ['//dimension//']'
    if (dimension == 'temperature') unit = ' [temperature in degC]'

    must_be_given = any_outside(values)
    if (present(required)) must_be_given = required
    default = 'required'
    if (.not. must_be_given) default = default_text()
    call self%record(key, type, dimension, default, range(min(3, len(range) + 1):), '', meaning)
    if (self%explaining) return

    call self%find(key, n_value, 'numbers', place)
    if (place < 0) return
    if (place == 0) then
      if (self%is_from_file() .and. must_be_given) then
        call self%fault(key, 'must be given'//range//unit)
      else if (.not. self%is_from_file() .and. any_outside(values)) then
        call self%fault(key, default_text()//': must be a number'//range//unit)
      end if
      return
    end if

    associate (items => self%entries(place)%items)
      allocate (numbers(size(items)), source=0.0_wp)
      do i = 1, size(items)
        which = ''
        if (size(items) > 1) which = 'value '//text(i)//' '
        complaint = 'must be a number, without quotes'
        if (.not. items(i)%quoted) call read_real(items(i)%text, numbers(i), complaint)
        if (complaint /= '') then
          call self%fault(key, which//complaint//range//unit)
          return
        end if
        numbers(i) = taken(numbers(i), dimension)
        if (any_outside(numbers(i:i))) then
          call self%fault(key, which//'must be '//range(3:)//unit)
          return
        end if
      end do
    end associate
    call move_alloc(numbers, values)

  contains

    pure function with_bound(start, word, bound) result(string)
      character(len=*), intent(in) :: start
      character(len=*), intent(in) :: word
      real(wp), intent(in), optional :: bound
      character(len=:), allocatable :: string

      string = start
      if (present(bound)) then
        string = joined(start, word//' '//number_text(shown(bound, dimension)))
      end if

    end function with_bound

    !> Nothing is compared with a number that is not finite: that would trap.
    pure function any_outside(candidates) result(outside)
      real(wp), intent(in) :: candidates(:)
      logical :: outside

      outside = .not. all(is_finite(candidates))
      if (outside) return
      if (present(above)) outside = outside .or. any(candidates <= above)
      if (present(below)) outside = outside .or. any(candidates >= below)
      if (present(lower)) outside = outside .or. any(candidates < lower)
      if (present(upper)) outside = outside .or. any(candidates > upper)

    end function any_outside

    pure function default_text() result(string)
      character(len=:), allocatable :: string

      integer :: j

      string = 'none'
      if (size(values) == 0) return
      if (.not. all(is_finite(values))) return
      string = number_text(shown(values(1), dimension))
      do j = 2, size(values)
        string = string//', '//number_text(shown(values(j), dimension))
      end do

    end function default_text

  end subroutine group_read_reals

  !> Raise a fault about a key; the first one wins.
  pure subroutine group_fault(self, key, complaint)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: complaint

    if (.not. self%status%failed()) self%misses_key = .not. self%given(key)
    call self%status%raise(STATUS_ERROR, 'group_take', self%describe(key)//': '//complaint)

  end subroutine group_fault

  !> Take an entry and count its values.
  pure subroutine group_find(self, key, n_value, expected, place)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    !> Values to be given, or `ANY_NUMBER`.
    integer, intent(in) :: n_value
    !> What these are, for a message.
    character(len=*), intent(in) :: expected
    !> 0 when the key is absent, -1 when the number of values is wrong.
    integer, intent(out) :: place

    integer :: n_given

    place = place_of(self, key)
    if (place == 0) return
    self%is_taken(place) = .true.

    n_given = size(self%entries(place)%items)
    if (n_value == ANY_NUMBER .or. n_given == n_value) return
    if (n_value == 1 .and. expected == 'numbers') then
      call self%fault(key, 'must be one number, '//text(n_given)//' values are given')
    else if (n_value == 1) then
      call self%fault(key, 'must be '//expected//', '//text(n_given)//' values are given')
    else
      call self%fault(key, 'must be '//text(n_value)//' '//expected//', given: '//text(n_given))
    end if
    place = -1

  end subroutine group_find

  !> True unless nobody has made this group.
  pure function group_is_from_file(self) result(from_file)
    class(group_t), intent(in) :: self
    logical :: from_file

    from_file = allocated(self%entries)

  end function group_is_from_file

  !> All keys asked for so far.
  pure subroutine group_list_known_keys(self, keys)
    class(group_t), intent(in) :: self
    character(len=NAME_LENGTH), allocatable, intent(out) :: keys(:)

    integer :: i, n

    n = 0
    if (allocated(self%options)) n = size(self%options)
    allocate (keys(n))
    do i = 1, n
      keys(i) = self%options(i)%key
    end do

  end subroutine group_list_known_keys

  !> Enter a key in the table, once.
  pure subroutine group_record(self, key, type, dimension, default, range, choices, meaning)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key, type, dimension, default, range, choices, meaning

    type(option_t), allocatable :: grown(:)
    integer :: i, n

    if (.not. allocated(self%options)) allocate (self%options(0))
    n = size(self%options)
    do i = 1, n
      if (self%options(i)%key == key) return
    end do
    allocate (grown(n + 1))
    grown(:n) = self%options
    grown(n + 1)%key = key
    grown(n + 1)%type = type
    grown(n + 1)%dimension = dimension
    grown(n + 1)%default = default
    grown(n + 1)%range = range
    grown(n + 1)%choices = choices
    grown(n + 1)%meaning = meaning
    call move_alloc(grown, self%options)

  end subroutine group_record

  !> Start of a message about a line of the group.
  pure function group_title_at(self, line) result(title)
    class(group_t), intent(in) :: self
    integer, intent(in) :: line
    character(len=:), allocatable :: title

    title = ''
    if (allocated(self%path)) title = position_text(self%path, line)//' '
    if (allocated(self%kind)) title = title//'&'//self%kind
    if (self%is_from_file() .and. line == 0) title = title//' (absent)'
    if (allocated(self%name)) then
      if (self%name /= '') title = title//' '''//self%name//''''
    end if
    if (title == '') title = 'parameters'

  end function group_title_at

  !> A range with one more bound: `, above 0 and below 1`.
  pure function joined(range, bound) result(longer)
    character(len=*), intent(in) :: range
    character(len=*), intent(in) :: bound
    character(len=:), allocatable :: longer

    longer = ', '//bound
    if (range /= '') longer = range//' and '//bound

  end function joined

  !> Place of a key among the entries, 0 when it is absent.
  pure function place_of(group, key) result(place)
    class(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    integer :: place

    place = 0
    if (.not. allocated(group%entries)) return
    do place = size(group%entries), 1, -1
      if (group%entries(place)%key == key) return
    end do

  end function place_of

end module swage_group
