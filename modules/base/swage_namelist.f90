!> Text in NAMELIST syntax, split into groups, keys and values; what they mean is not known here.
!>
!> `&kind key = value, value key = value ... /`, over any number of lines. Values are separated by
!> blanks, commas or ends of line, `3*0.0` stands for three of them, texts are quoted by `'` or `"`
!> (doubled inside themselves) on one line, `!` starts a comment. Kinds and keys know no case.
!> Stricter than Fortran's own reader where that would hide a slip: nothing but comments stands
!> between groups, no key comes twice, no value is left out.
module swage_namelist
  use swage_status, only: status_t, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: item_t, entry_t, namelist_group_t, namelist_parse, position_text

  !> One value.
  type :: item_t
    !> As written; a quoted text without its quotes.
    character(len=:), allocatable :: text
    logical :: quoted = .false.
  end type item_t

  !> One `key = value, value, ...`.
  type :: entry_t
    !> In lower case.
    character(len=:), allocatable :: key
    !> All values as written, on one line.
    character(len=:), allocatable :: written
    !> Line of the key.
    integer :: line = 0
    !> The values, repeated ones as often as asked.
    type(item_t), allocatable :: items(:)
  end type entry_t

  !> One `&kind ... /`.
  type :: namelist_group_t
    !> In lower case.
    character(len=:), allocatable :: kind
    !> Line of the `&`.
    integer :: line = 0
    type(entry_t), allocatable :: entries(:)
  end type namelist_group_t

  !> Longest list that a repeat count may make.
  integer, parameter :: MAX_REPEAT = 1000000

  character(len=1), parameter :: TAB = achar(9)
  character(len=1), parameter :: LINE_FEED = achar(10)
  character(len=1), parameter :: CARRIAGE_RETURN = achar(13)
  character(len=*), parameter :: BLANKS = ' '//TAB//LINE_FEED//CARRIAGE_RETURN
  character(len=*), parameter :: WORD_ENDS = BLANKS//',=!/&''"'
  !> Mark that some editors put before UTF-8.
  character(len=*), parameter :: BYTE_ORDER_MARK = char(239)//char(187)//char(191)

  integer, parameter :: TOKEN_END = 0
  integer, parameter :: TOKEN_GROUP = 1
  integer, parameter :: TOKEN_SLASH = 2
  integer, parameter :: TOKEN_KEY = 3
  integer, parameter :: TOKEN_COMMA = 4
  integer, parameter :: TOKEN_WORD = 5
  integer, parameter :: TOKEN_QUOTED = 6
  integer, parameter :: TOKEN_OPEN_QUOTE = 7
  integer, parameter :: TOKEN_EQUALS = 8

  !> The next piece of the text.
  type :: token_t
    integer :: kind = TOKEN_END
    !> Name of a group or key without `&` and `=`; otherwise as `item_t`.
    character(len=:), allocatable :: text
    integer :: line = 1
    !> Where it begins and ends in the text.
    integer :: first = 1, last = 0
  end type token_t

  !> A place in the text.
  type :: reader_t
    character(len=:), allocatable :: source
    !> Named in messages.
    character(len=:), allocatable :: path
    !> The next character.
    integer :: place = 1
    !> Its line.
    integer :: line = 1
  end type reader_t

contains

  !> Split a text into its groups, in their order.
  pure subroutine namelist_parse(source, path, groups, status)
    character(len=*), intent(in) :: source
    !> Named in messages.
    character(len=*), intent(in) :: path
    type(namelist_group_t), allocatable, intent(out) :: groups(:)
    !> `STATUS_ERROR` with path and line when the text breaks the syntax.
    type(status_t), intent(inout) :: status

    type(namelist_group_t) :: group
    type(reader_t) :: reader
    type(token_t) :: token

    allocate (groups(0))
    reader%source = source
    reader%path = path
    if (index(source, BYTE_ORDER_MARK) == 1) reader%place = len(BYTE_ORDER_MARK) + 1
    do
      call next_token(reader, token)
      select case (token%kind)
      case (TOKEN_END)
        return
      case (TOKEN_GROUP)
        call parse_group(reader, token, group, status)
        if (status%failed()) return
        call append_group(groups, group)
      case default
        call complain(reader, token%line, ' '//clipped(source(token%first:token%last))// &
                      ': stands in no group; a group is written &kind key = value ... /, '// &
                      'texts with a "/" in quotes, comments after "!"', status)
        return
      end select
    end do

  end subroutine namelist_parse

  !> `path:line:`, the start of a message; `path:` when the line is 0, nowhere in the file.
  pure function position_text(path, line) result(position)
    character(len=*), intent(in) :: path
    integer, intent(in) :: line
    character(len=:), allocatable :: position

    position = path//':'
    if (line > 0) position = position//text(line)//':'

  end function position_text

  !> The entries of a group, up to and with its `/`.
  pure subroutine parse_group(reader, opening, group, status)
    type(reader_t), intent(inout) :: reader
    !> The `&kind`.
    type(token_t), intent(in) :: opening
    type(namelist_group_t), intent(out) :: group
    type(status_t), intent(inout) :: status

    type(token_t) :: token

    group%kind = opening%text
    group%line = opening%line
    allocate (group%entries(0))
    if (group%kind == '') then
      call complain(reader, opening%line, ' "&" without the kind of a group', status)
      return
    end if

    call next_token(reader, token)
    do
      select case (token%kind)
      case (TOKEN_SLASH)
        return
      case (TOKEN_KEY)
        call parse_entry(reader, token, group, status)
        if (status%failed()) return
      case (TOKEN_END)
        call complain(reader, group%line, ' &'//group%kind//': not closed by "/" before the '// &
                      'end of the file', status)
        return
      case (TOKEN_GROUP)
        call complain(reader, group%line, ' &'//group%kind//': not closed by "/" before &'// &
                      token%text//' in line '//text(token%line), status)
        return
      case default
        call complain(reader, token%line, ' &'//group%kind//': expected key = value, found '// &
                      clipped(reader%source(token%first:token%last)), status)
        return
      end select
    end do

  end subroutine parse_group

  !> One key with its values.
  pure subroutine parse_entry(reader, token, group, status)
    type(reader_t), intent(inout) :: reader
    !> In: the key. Out: what follows the last value.
    type(token_t), intent(inout) :: token
    type(namelist_group_t), intent(inout) :: group
    type(status_t), intent(inout) :: status

    type(entry_t) :: entry
    character(len=:), allocatable :: start
    integer :: i
    logical :: comma_allowed

    entry%key = token%text
    entry%line = token%line
    entry%written = ''
    allocate (entry%items(0))
    start = ' &'//group%kind//': '//entry%key
    do i = 1, size(group%entries)
      if (group%entries(i)%key /= entry%key) cycle
      call complain(reader, entry%line, start//': given twice, first in line '// &
                    text(group%entries(i)%line)//'; keep one of them', status)
      return
    end do
    if (index(entry%key, '(') > 0) then
      call complain(reader, entry%line, start//': give all values in one list, as '// &
                    entry%key(:index(entry%key, '(') - 1)//' = 1.0, 2.0', status)
      return
    end if

    comma_allowed = .false.
    do
      call next_token(reader, token)
      select case (token%kind)
      case (TOKEN_WORD, TOKEN_QUOTED)
        call parse_item(reader, token, start, entry, status)
        if (status%failed()) return
        comma_allowed = .true.
      case (TOKEN_COMMA)
        if (.not. comma_allowed) then
          call complain(reader, token%line, start//': a comma without a value before it', status)
          return
        end if
        comma_allowed = .false.
      case (TOKEN_OPEN_QUOTE)
        call complain(reader, token%line, start//' = '// &
                      clipped(reader%source(token%first:token%last))// &
                      ': the quote is not closed on its line', status)
        return
      case (TOKEN_EQUALS)
        call complain(reader, token%line, start//': "=" without a key before it', status)
        return
      case default
        exit
      end select
    end do

    if (size(entry%items) == 0) then
      call complain(reader, entry%line, start//': has no value', status)
      return
    end if
    call append_entry(group%entries, entry)

  end subroutine parse_entry

  !> One value, or several equal ones written as `3*0.0`.
  pure subroutine parse_item(reader, token, start, entry, status)
    type(reader_t), intent(inout) :: reader
    type(token_t), intent(in) :: token
    !> Of a message: group and key.
    character(len=*), intent(in) :: start
    type(entry_t), intent(inout) :: entry
    type(status_t), intent(inout) :: status

    type(item_t) :: item
    type(token_t) :: repeated
    integer :: count, last, star

    item%text = token%text
    item%quoted = token%kind == TOKEN_QUOTED
    count = 1
    last = token%last
    star = 0
    if (.not. item%quoted) star = index(item%text, '*')
    if (star > 1) then
      call read_count(item%text(:star - 1), count)
      item%text = item%text(star + 1:)
      if (item%text == '') then
        if (scan(next_character(reader), '''"') > 0) then
          call next_token(reader, repeated)
          item%text = repeated%text
          item%quoted = repeated%kind == TOKEN_QUOTED
          last = repeated%last
        end if
        if (.not. item%quoted) count = 0
      end if
      if (count == 0) then
        call complain(reader, token%line, start//' = '// &
                      clipped(reader%source(token%first:last))//': a repetition is written '// &
                      'count*value, as 3*0.0, with a count up to '//text(MAX_REPEAT), status)
        return
      end if
    end if

    if (entry%written /= '') entry%written = entry%written//', '
    entry%written = entry%written//reader%source(token%first:last)
    call append_items(entry%items, item, count)

  end subroutine parse_item

  !> The count before a star, 0 when it is none.
  pure subroutine read_count(digits, count)
    character(len=*), intent(in) :: digits
    integer, intent(out) :: count

    integer :: code, number

    count = 0
    if (verify(digits, '0123456789') > 0) return
    read (digits, *, iostat=code) number
    if (code /= 0) return
    if (number <= MAX_REPEAT) count = number

  end subroutine read_count

  !> The next piece of the text; a word before `=` becomes a key.
  pure subroutine next_token(reader, token)
    type(reader_t), intent(inout) :: reader
    type(token_t), intent(out) :: token

    type(reader_t) :: ahead
    character(len=1) :: letter

    call skip_blanks(reader)
    token%line = reader%line
    token%first = reader%place
    token%last = reader%place
    token%text = ''
    if (reader%place > len(reader%source)) then
      token%last = token%first - 1
      return
    end if

    letter = next_character(reader)
    select case (letter)
    case ('/', ',', '=')
      if (letter == '/') token%kind = TOKEN_SLASH
      if (letter == ',') token%kind = TOKEN_COMMA
      if (letter == '=') token%kind = TOKEN_EQUALS
      reader%place = reader%place + 1
    case ('''', '"')
      call read_quoted(reader, letter, token)
    case ('&')
      reader%place = reader%place + 1
      token%kind = TOKEN_GROUP
      call read_word(reader, token%text)
      token%text = lower_case(token%text)
      token%last = reader%place - 1
    case default
      token%kind = TOKEN_WORD
      call read_word(reader, token%text)
      token%last = reader%place - 1
      ahead = reader
      call skip_blanks(ahead)
      if (next_character(ahead) == '=') then
        token%kind = TOKEN_KEY
        token%text = lower_case(token%text)
        reader%place = ahead%place + 1
        reader%line = ahead%line
      end if
    end select

  end subroutine next_token

  !> A quoted text; inside it the quote is written twice.
  pure subroutine read_quoted(reader, quote, token)
    type(reader_t), intent(inout) :: reader
    character(len=1), intent(in) :: quote
    type(token_t), intent(inout) :: token

    character(len=1) :: letter

    token%kind = TOKEN_OPEN_QUOTE
    do
      reader%place = reader%place + 1
      letter = next_character(reader)
      if (letter == LINE_FEED .or. reader%place > len(reader%source)) exit
      if (letter == quote) then
        reader%place = reader%place + 1
        if (next_character(reader) /= quote) then
          token%kind = TOKEN_QUOTED
          exit
        end if
      end if
      token%text = token%text//letter
    end do
    token%last = reader%place - 1

  end subroutine read_quoted

  !> The letters up to a blank or a character with a meaning; none, if one of these comes first.
  pure subroutine read_word(reader, word)
    type(reader_t), intent(inout) :: reader
    character(len=:), allocatable, intent(out) :: word

    integer :: length

    length = scan(reader%source(reader%place:), WORD_ENDS) - 1
    if (length < 0) length = len(reader%source) - reader%place + 1
    word = reader%source(reader%place:reader%place + length - 1)
    reader%place = reader%place + length

  end subroutine read_word

  !> Go to the next character that is neither blank nor comment.
  pure subroutine skip_blanks(reader)
    type(reader_t), intent(inout) :: reader

    character(len=1) :: letter
    logical :: in_comment

    in_comment = .false.
    do while (reader%place <= len(reader%source))
      letter = next_character(reader)
      if (letter == '!') in_comment = .true.
      if (letter == LINE_FEED) in_comment = .false.
      if (.not. in_comment .and. index(BLANKS, letter) == 0) return
      if (letter == LINE_FEED) reader%line = reader%line + 1
      reader%place = reader%place + 1
    end do

  end subroutine skip_blanks

  !> The character at the place of the reader, an end of line past the last one.
  pure function next_character(reader) result(letter)
    type(reader_t), intent(in) :: reader
    character(len=1) :: letter

    letter = LINE_FEED
    if (reader%place > len(reader%source)) return
    letter = reader%source(reader%place:reader%place)

  end function next_character

  !> Letters A to Z as a to z.
  pure function lower_case(word) result(lower)
    character(len=*), intent(in) :: word
    character(len=:), allocatable :: lower

    character(len=*), parameter :: UPPER_LETTERS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZ'
    character(len=*), parameter :: LOWER_LETTERS = 'abcdefghijklmnopqrstuvwxyz'

    integer :: i, letter

    lower = word
    do i = 1, len(word)
      letter = index(UPPER_LETTERS, word(i:i))
      if (letter > 0) lower(i:i) = LOWER_LETTERS(letter:letter)
    end do

  end function lower_case

  !> The start of a text that may be too long for a message.
  pure function clipped(long) result(short)
    character(len=*), intent(in) :: long
    character(len=:), allocatable :: short

    integer, parameter :: LONGEST = 60

    short = long(:verify(long, BLANKS, back=.true.))
    if (len(short) > LONGEST) short = long(:LONGEST)//'...'

  end function clipped

  !> Refuse the text.
  pure subroutine complain(reader, line, complaint, status)
    type(reader_t), intent(in) :: reader
    integer, intent(in) :: line
    character(len=*), intent(in) :: complaint
    type(status_t), intent(inout) :: status

    call status%raise(STATUS_ERROR, 'namelist_parse', position_text(reader%path, line)//complaint)

  end subroutine complain

  pure subroutine append_group(groups, group)
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    type(namelist_group_t), intent(in) :: group

    type(namelist_group_t), allocatable :: grown(:)

    allocate (grown(size(groups) + 1))
    grown(:size(groups)) = groups
    grown(size(grown)) = group
    call move_alloc(grown, groups)

  end subroutine append_group

  pure subroutine append_entry(entries, entry)
    type(entry_t), allocatable, intent(inout) :: entries(:)
    type(entry_t), intent(in) :: entry

    type(entry_t), allocatable :: grown(:)

    allocate (grown(size(entries) + 1))
    grown(:size(entries)) = entries
    grown(size(grown)) = entry
    call move_alloc(grown, entries)

  end subroutine append_entry

  !> Append an item `count` times.
  pure subroutine append_items(items, item, count)
    type(item_t), allocatable, intent(inout) :: items(:)
    type(item_t), intent(in) :: item
    integer, intent(in) :: count

    type(item_t), allocatable :: grown(:)
    integer :: i

    allocate (grown(size(items) + count))
    grown(:size(items)) = items
    do i = size(items) + 1, size(grown)
      grown(i) = item
    end do
    call move_alloc(grown, items)

  end subroutine append_items

end module swage_namelist
