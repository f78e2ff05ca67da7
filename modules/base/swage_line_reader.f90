!> Reading of large text files, line by line and word by word, with messages that name the line.
module swage_line_reader
  use swage_kinds, only: gp, wp
  use swage_path, only: describe_unreadable
  use swage_status, only: status_t, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: line_reader_t

  !> Characters read at once, and so the longest line.
  integer, parameter :: BLOCK_LENGTH = 2**20

  !> An open text file and a place in it. Owns a unit: call `close`; do not copy.
  type :: line_reader_t
    private
    integer :: unit = -1
    integer :: exit_code = 0
    character(len=:), allocatable :: path
    !> Part of the file that is in memory: `buffer(:n_filled)`.
    character(len=:), allocatable :: buffer
    integer :: n_filled = 0
    !> Characters of the file that are not in memory yet.
    integer(gp) :: n_left = 0_gp
    integer :: line_number = 0
    !> Last character of the current line in the buffer, without the end of the line.
    integer :: last_of_line = 0
    !> First character of the current line that has not been taken.
    integer :: position = 1
    !> First character of the next line.
    integer :: next_line = 1
  contains
    !> Open a file for reading.
    procedure, public :: open => reader_open
    !> Go to the next line; false at the end of the file.
    procedure, public :: next => reader_next
    !> Go to the next line, which must exist.
    procedure, public :: advance => reader_advance
    !> The part of the current line that has not been taken, without the blanks around it.
    procedure, public :: line => reader_line
    !> Read the next word of the line; empty at its end.
    procedure, public :: take_word => reader_take_word
    !> Read the next word of the line, which must be an integer.
    procedure, public :: take_integer => reader_take_integer
    !> Read the next word of the line, which must be a number.
    procedure, public :: take_real => reader_take_real
    !> Read the next text of the line, which must stand between double quotes.
    procedure, public :: take_quoted => reader_take_quoted
    !> Raise a failure that names file and line.
    procedure, public :: fail => reader_fail
    !> Release the unit. Harmless when nothing is open.
    procedure, public :: close => reader_close
    procedure, private :: find_word
    procedure, private :: fill => reader_fill
  end type line_reader_t

contains

  subroutine reader_open(self, path, exit_code, status)
    class(line_reader_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    !> `EXIT_*` of the failures that come from this file.
    integer, intent(in) :: exit_code
    !> `STATUS_ERROR` when the file cannot be opened.
    type(status_t), intent(inout) :: status

    character(len=256) :: reason
    integer :: code

    call self%close()
    self%path = path
    self%exit_code = exit_code
    self%line_number = 0
    self%n_filled = 0
    self%last_of_line = 0
    self%position = 1
    self%next_line = 1
    open (newunit=self%unit, file=path, action='read', status='old', form='unformatted', &
          access='stream', iostat=code, iomsg=reason)
    if (code /= 0) then
      self%unit = -1
      call status%raise(STATUS_ERROR, 'line_reader_open', path // ': cannot be opened: ' // &
                        describe_unreadable(path, reason), exit_code)
      return
    end if
    inquire (unit=self%unit, size=self%n_left)
    if (.not. allocated(self%buffer)) allocate (character(len=BLOCK_LENGTH) :: self%buffer)

  end subroutine reader_open

  subroutine reader_next(self, found, status)
    class(line_reader_t), intent(inout) :: self
    logical, intent(out) :: found
    !> `STATUS_ERROR` when the file cannot be read.
    type(status_t), intent(inout) :: status

    integer :: length

    found = .false.
    if (status%failed()) return
    self%position = self%next_line
    length = index(self%buffer(self%position:self%n_filled), new_line('a'))
    if (length == 0 .and. self%n_left > 0_gp) then
      call self%fill(status)
      if (status%failed()) return
      length = index(self%buffer(self%position:self%n_filled), new_line('a'))
      if (length == 0 .and. self%n_left > 0_gp) then
        self%line_number = self%line_number + 1
        call self%fail('the line is longer than ' // text(BLOCK_LENGTH) // ' characters', status)
        return
      end if
    end if
    ! The last line may lack its end.
    self%last_of_line = self%position + length - 2
    if (length == 0) self%last_of_line = self%n_filled
    self%next_line = self%last_of_line + 2
    found = length > 0 .or. self%last_of_line >= self%position
    if (found) self%line_number = self%line_number + 1

  end subroutine reader_next

  subroutine reader_advance(self, status)
    class(line_reader_t), intent(inout) :: self
    !> `STATUS_ERROR` at the end of the file.
    type(status_t), intent(inout) :: status

    logical :: found

    call self%next(found, status)
    if (status%failed()) return
    if (.not. found) call self%fail('the file ends too early: it is truncated', status)

  end subroutine reader_advance

  function reader_line(self) result(line)
    class(line_reader_t), intent(in) :: self
    character(len=:), allocatable :: line

    integer :: first, last

    first = self%position
    last = self%last_of_line
    do while (first <= last)
      if (.not. is_blank(self%buffer(first:first))) exit
      first = first + 1
    end do
    do while (last >= first)
      if (.not. is_blank(self%buffer(last:last))) exit
      last = last - 1
    end do
    line = self%buffer(first:last)

  end function reader_line

  !> Move what has not been read to the front of the buffer and fill the rest from the file.
  subroutine reader_fill(self, status)
    class(line_reader_t), intent(inout) :: self
    !> `STATUS_ERROR` when the file cannot be read.
    type(status_t), intent(inout) :: status

    character(len=256) :: reason
    integer :: code, n_kept, n_new

    n_kept = self%n_filled - self%position + 1
    self%buffer(:n_kept) = self%buffer(self%position:self%n_filled)
    n_new = int(min(int(len(self%buffer) - n_kept, gp), self%n_left))
    read (self%unit, iostat=code, iomsg=reason) self%buffer(n_kept + 1:n_kept + n_new)
    if (code /= 0) then
      call self%fail(describe_unreadable(self%path, reason), status)
      return
    end if
    self%position = 1
    self%n_filled = n_kept + n_new
    self%n_left = self%n_left - int(n_new, gp)

  end subroutine reader_fill

  !> Bounds of the next word; empty (last < first) at the end of the line.
  pure subroutine find_word(self, first, last)
    class(line_reader_t), intent(in) :: self
    integer, intent(out) :: first
    integer, intent(out) :: last

    first = self%position
    do while (first <= self%last_of_line)
      if (.not. is_blank(self%buffer(first:first))) exit
      first = first + 1
    end do
    last = first
    do while (last <= self%last_of_line)
      if (is_blank(self%buffer(last:last))) exit
      last = last + 1
    end do
    last = last - 1

  end subroutine find_word

  subroutine reader_take_word(self, word)
    class(line_reader_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: word

    integer :: first, last

    call self%find_word(first, last)
    word = self%buffer(first:last)
    self%position = last + 1

  end subroutine reader_take_word

  subroutine reader_take_integer(self, value, status)
    class(line_reader_t), intent(inout) :: self
    integer(gp), intent(out) :: value
    !> `STATUS_ERROR` when the line ends or the word is not an integer of at most 18 digits.
    type(status_t), intent(inout) :: status

    integer, parameter :: MAX_DIGITS = 18
    integer :: digit, first, i, last, start
    logical :: valid

    value = 0_gp
    if (status%failed()) return
    call self%find_word(first, last)
    start = first
    if (first <= last) start = first + merge(1, 0, scan(self%buffer(first:first), '+-') == 1)
    valid = start <= last .and. last - start < MAX_DIGITS
    if (valid) then
      do i = start, last
        digit = iachar(self%buffer(i:i)) - iachar('0')
        if (digit < 0 .or. digit > 9) then
          valid = .false.
          exit
        end if
        value = 10_gp * value + int(digit, gp)
      end do
    end if
    if (.not. valid) then
      value = 0_gp
      call fail_word(self, first, last, 'an integer', status)
      return
    end if
    if (self%buffer(first:first) == '-') value = -value
    self%position = last + 1

  end subroutine reader_take_integer

  subroutine reader_take_real(self, value, status)
    class(line_reader_t), intent(inout) :: self
    real(wp), intent(out) :: value
    !> `STATUS_ERROR` when the line ends or the word is not a finite number.
    type(status_t), intent(inout) :: status

    integer :: code, first, last

    value = 0.0_wp
    if (status%failed()) return
    call self%find_word(first, last)
    code = 1
    ! The characters are checked first: a formatted read also takes blanks, Inf and NaN.
    if (first <= last) then
      if (verify(self%buffer(first:last), '0123456789+-.eEdD') == 0) then
        read (self%buffer(first:last), '(f64.0)', iostat=code) value
      end if
    end if
    if (code == 0) then
      if (abs(value) > huge(value)) code = 1
    end if
    if (code /= 0) then
      value = 0.0_wp
      call fail_word(self, first, last, 'a number', status)
      return
    end if
    self%position = last + 1

  end subroutine reader_take_real

  subroutine reader_take_quoted(self, value, status)
    class(line_reader_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: value
    !> `STATUS_ERROR` when there is none.
    type(status_t), intent(inout) :: status

    integer :: first, last

    value = ''
    if (status%failed()) return
    first = index(self%buffer(self%position:self%last_of_line), '"')
    last = index(self%buffer(self%position:self%last_of_line), '"', back=.true.)
    if (last <= first) then
      call self%fail('a text between double quotes is expected', status)
      return
    end if
    value = self%buffer(self%position + first:self%position + last - 2)
    self%position = self%position + last

  end subroutine reader_take_quoted

  subroutine reader_fail(self, why, status)
    class(line_reader_t), intent(in) :: self
    !> What is wrong and what would be right.
    character(len=*), intent(in) :: why
    type(status_t), intent(inout) :: status

    call status%raise(STATUS_ERROR, 'line_reader', &
                      self%path // ':' // text(self%line_number) // ': ' // why, self%exit_code)

  end subroutine reader_fail

  subroutine reader_close(self)
    class(line_reader_t), intent(inout) :: self

    if (self%unit /= -1) close (self%unit)
    self%unit = -1

  end subroutine reader_close

  !> Raise that a word is not of the expected kind.
  subroutine fail_word(reader, first, last, expected, status)
    type(line_reader_t), intent(in) :: reader
    integer, intent(in) :: first, last
    character(len=*), intent(in) :: expected
    type(status_t), intent(inout) :: status

    if (first > last) then
      call reader%fail('the line ends where ' // expected // ' is expected', status)
    else
      call reader%fail('''' // reader%buffer(first:last) // ''' is not ' // expected, status)
    end if

  end subroutine fail_word

  !> Blank, tabulator, or the carriage return of a file from another system.
  elemental function is_blank(character_) result(blank)
    character(len=1), intent(in) :: character_
    logical :: blank

    blank = character_ == ' ' .or. character_ == achar(9) .or. character_ == achar(13)

  end function is_blank

end module swage_line_reader
