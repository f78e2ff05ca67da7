!> The keys of a group as a table for readers: what `swage --explain` prints.
module swage_option_table
  implicit none(type, external)
  private

  public :: option_t, explain_text

  !> One key of a group. The words are ready to print; empty where there is nothing to say.
  type :: option_t
    character(len=:), allocatable :: key
    !> `real`, `3 reals`, `reals`, `integer`, `logical`, `text`, `texts`.
    character(len=:), allocatable :: type
    !> Of real values: `length/time`.
    character(len=:), allocatable :: dimension
    !> As it would be written in the file; `required` when the key must be given.
    character(len=:), allocatable :: default
    !> `above 0, at most 1`.
    character(len=:), allocatable :: range
    !> `'a' | 'b'`.
    character(len=:), allocatable :: choices
    !> One sentence.
    character(len=:), allocatable :: meaning
  end type option_t

  character(len=1), parameter :: LINE_FEED = achar(10)
  integer, parameter :: PAGE_WIDTH = 100

contains

  !> A page about one kind of group: a line of head, then for each key its type, default and
  !> allowed values in columns, with the meaning below; lines of 100 columns, ended by line feeds.
  pure function explain_text(kind, purpose, options) result(page)
    !> As `material`.
    character(len=*), intent(in) :: kind
    !> What the group is for, in a sentence.
    character(len=*), intent(in) :: purpose
    type(option_t), intent(in) :: options(:)
    character(len=:), allocatable :: page

    character(len=*), parameter :: HEADS(*) = [character(len=7) :: 'key', 'type', 'default']

    integer :: allowed_column, default_column, i, type_column

    type_column = 2 + len_trim(HEADS(1)) + 2
    do i = 1, size(options)
      type_column = max(type_column, 2 + len(options(i)%key) + 2)
    end do
    default_column = type_column + len_trim(HEADS(2)) + 2
    do i = 1, size(options)
      default_column = max(default_column, type_column + len(full_type(options(i))) + 2)
    end do
    allowed_column = default_column + len_trim(HEADS(3)) + 2
    do i = 1, size(options)
      allowed_column = max(allowed_column, default_column + len(options(i)%default) + 2)
    end do
    ! A long default must not push the last column off the page
    allowed_column = min(allowed_column, default_column + 24)

    page = '&'//kind//LINE_FEED//wrapped('  '//purpose, 2)//LINE_FEED
    page = page//padded(padded(padded('  '//trim(HEADS(1)), type_column)//trim(HEADS(2)), &
                               default_column)//trim(HEADS(3)), allowed_column)//'allowed'// &
           LINE_FEED
    do i = 1, size(options)
      page = page//wrapped( &
             trim(padded(padded(padded('  '//options(i)%key, type_column)// &
                                full_type(options(i)), default_column)//options(i)%default, &
                         allowed_column)//options(i)%range//options(i)%choices), allowed_column)
      page = page//wrapped('      '//options(i)%meaning, 6)
    end do

  end function explain_text

  !> `real [stress]`; where degrees Celsius are read, it says so.
  pure function full_type(option) result(description)
    type(option_t), intent(in) :: option
    character(len=:), allocatable :: description

    description = option%type
    if (option%dimension == '') return
    description = description//' ['//option%dimension
    if (option%dimension == 'temperature') description = description//' in degC'
    description = description//']'

  end function full_type

  !> A text filled with blanks up to a column, two of them at least.
  pure function padded(start, width) result(line)
    character(len=*), intent(in) :: start
    integer, intent(in) :: width
    character(len=:), allocatable :: line

    line = start//repeat(' ', max(2, width - len(start)))

  end function padded

  !> One or more lines, broken at blanks; those that follow begin at a column.
  pure function wrapped(long, column) result(lines)
    character(len=*), intent(in) :: long
    !> Blanks before each line but the first.
    integer, intent(in) :: column
    character(len=:), allocatable :: lines

    character(len=:), allocatable :: rest
    integer :: cut, indent

    indent = min(column, PAGE_WIDTH / 2)
    lines = ''
    rest = long
    do while (len(rest) > PAGE_WIDTH)
      cut = scan(rest(:PAGE_WIDTH + 1), ' ', back=.true.)
      ! A word longer than the line is left whole
      if (verify(rest(:cut), ' ') == 0) cut = PAGE_WIDTH + scan(rest(PAGE_WIDTH + 1:)//' ', ' ')
      lines = lines//trim(rest(:min(cut, len(rest))))//LINE_FEED
      if (cut >= len(rest)) return
      rest = repeat(' ', indent)//trim(adjustl(rest(cut + 1:)))
    end do
    lines = lines//rest//LINE_FEED

  end function wrapped

end module swage_option_table
