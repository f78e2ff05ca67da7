!> Tables in text files: columns of numbers under a line of names, as spreadsheets export them.
module swage_table_file
  use swage_kinds, only: wp
  use swage_line_reader, only: line_reader_t
  use swage_number, only: read_real
  use swage_status, only: EXIT_INPUT, status_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: table_file_read, COLUMN_NAME_LENGTH

  !> Longest name of a column.
  integer, parameter :: COLUMN_NAME_LENGTH = 32

  !> What may stand between two words: comma, semicolon, blank, tabulator.
  character(len=*), parameter :: SEPARATORS = ',; '//achar(9)

contains

  !> Read a table. Every rank may call it on its own: the files are small.
  !>
  !> The first line names the columns; each other line holds a number for each of them. Words are
  !> separated by commas, semicolons, blanks or tabulators. Empty lines and what follows `#` do
  !> not count.
  subroutine table_file_read(path, names, values, status)
    character(len=*), intent(in) :: path
    !> Of the columns, as in the file.
    character(len=COLUMN_NAME_LENGTH), allocatable, intent(out) :: names(:)
    !> Shape (rows, columns).
    real(wp), allocatable, intent(out) :: values(:, :)
    !> `STATUS_ERROR`, with file and line, when the file cannot be read, has no line of names, or a
    !> line that is not a number for each name.
    type(status_t), intent(inout) :: status

    type(line_reader_t) :: reader

    call reader%open(path, EXIT_INPUT, status)
    if (status%failed()) return
    call read_names(reader, names, status)
    call read_rows(reader, names, values, status)
    call reader%close()

  end subroutine table_file_read

  !> Read the line of names.
  subroutine read_names(reader, names, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=COLUMN_NAME_LENGTH), allocatable, intent(out) :: names(:)
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault, line
    logical :: found
    integer :: i, first, last
    real(wp) :: number

    allocate (names(0))
    number = 0.0_wp
    call next_line(reader, line, found, status)
    if (status%failed()) return
    if (.not. found) then
      call reader%fail('the table is empty', status)
      return
    end if

    deallocate (names)
    allocate (names(n_word(line)))
    last = 0
    do i = 1, size(names)
      call find_word(line, last + 1, first, last)
      names(i) = line(first:last)
      call read_real(line(first:last), number, fault)
      if (fault == '') then
        call reader%fail('the first line must name the columns, as time,displacement', status)
        return
      end if
    end do

  end subroutine read_names

  !> Read the numbers.
  subroutine read_rows(reader, names, values, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=COLUMN_NAME_LENGTH), intent(in) :: names(:)
    real(wp), allocatable, intent(out) :: values(:, :)
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: line
    logical :: found
    integer :: n_row
    real(wp), allocatable :: grown(:, :), rows(:, :)

    ! Column by column in memory only at the end: rows arrive one by one
    allocate (rows(size(names), 64))
    n_row = 0
    do
      call next_line(reader, line, found, status)
      if (status%failed() .or. .not. found) exit
      if (n_row == size(rows, 2)) then
        allocate (grown(size(names), 2 * n_row))
        grown(:, :n_row) = rows
        call move_alloc(grown, rows)
      end if
      n_row = n_row + 1
      call read_row(reader, line, names, rows(:, n_row), status)
    end do
    if (.not. status%failed() .and. n_row == 0) then
      call reader%fail('there is no line of numbers below the names', status)
    end if
    allocate (values(n_row, size(names)))
    values = transpose(rows(:, :n_row))

  end subroutine read_rows

  !> Read one line of numbers.
  subroutine read_row(reader, line, names, row, status)
    type(line_reader_t), intent(in) :: reader
    character(len=*), intent(in) :: line
    character(len=COLUMN_NAME_LENGTH), intent(in) :: names(:)
    real(wp), intent(out) :: row(:)
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault
    integer :: first, i, last

    row = 0.0_wp
    if (n_word(line) /= size(names)) then
      call reader%fail('must have a number for each of the '//text(size(names))// &
                       ' columns, has '//text(n_word(line)), status)
      return
    end if
    last = 0
    do i = 1, size(names)
      call find_word(line, last + 1, first, last)
      call read_real(line(first:last), row(i), fault)
      if (fault /= '') then
        call reader%fail(trim(names(i))//' = '//line(first:last)//': '//fault, status)
        return
      end if
    end do

  end subroutine read_row

  !> The next line that holds a word, without its comment.
  subroutine next_line(reader, line, found, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=:), allocatable, intent(out) :: line
    !> False at the end of the file.
    logical, intent(out) :: found
    type(status_t), intent(inout) :: status

    line = ''
    do
      call reader%next(found, status)
      if (status%failed() .or. .not. found) return
      line = reader%line()
      ! The carriage return of files from elsewhere
      if (index(line, achar(13)) > 0) line = line(:index(line, achar(13)) - 1)
      if (index(line, '#') > 0) line = line(:index(line, '#') - 1)
      if (n_word(line) > 0) return
    end do

  end subroutine next_line

  !> How many words a line has.
  pure function n_word(line) result(n)
    character(len=*), intent(in) :: line
    integer :: n

    integer :: first, last

    n = 0
    last = 0
    do
      call find_word(line, last + 1, first, last)
      if (first > len(line)) return
      n = n + 1
    end do

  end function n_word

  !> Bounds of the first word at or after `start`; `first` is past the end when there is none.
  pure subroutine find_word(line, start, first, last)
    character(len=*), intent(in) :: line
    integer, intent(in) :: start
    integer, intent(out) :: first
    integer, intent(out) :: last

    integer :: length

    first = len(line) + 1
    last = len(line)
    if (start > len(line)) return
    length = verify(line(start:), SEPARATORS)
    if (length == 0) return
    first = start + length - 1
    length = scan(line(first:), SEPARATORS)
    if (length > 0) last = first + length - 2

  end subroutine find_word

end module swage_table_file
