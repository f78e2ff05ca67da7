!> History of a run as a table of comma-separated values: one row a step, for spreadsheets and
!> `tools/plot`.
module swage_history
  use swage_comm, only: comm_t
  use swage_file_mark, only: check_mark, cut_to_mark, mark_file
  use swage_finite, only: is_finite
  use swage_kinds, only: wp
  use swage_output_path, only: describe_refusal
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_units, only: shown, units_t
  implicit none(type, external)
  private

  public :: history_t, full_text

  !> Entry of a snapshot that says how far the file had grown.
  character(len=*), parameter :: MARK = 'history'

  !> A column and its value in the row in hand.
  type :: column_t
    character(len=64) :: name = ''
    character(len=64) :: dimension = '1'
    character(len=64) :: label = ''
    real(wp) :: value = 0.0_wp
    logical :: is_set = .false.
  end type column_t

  !> A table that grows by rows. Owns a file on rank 0: call `close`; do not copy.
  !>
  !> First all columns are declared; a row is one `set` a column and `append`. The values are those
  !> of rank 0.
  type :: history_t
    private
    type(comm_t) :: comm
    type(units_t) :: units
    character(len=:), allocatable :: path
    integer :: unit = -1
    logical :: is_open = .false.
    logical :: has_header = .false.
    type(column_t), allocatable :: columns(:)
  contains
    !> Create the file, or prepare to go on in one that exists.
    procedure, public :: open => history_open
    !> Go on behind the rows that the file held when a snapshot was taken.
    procedure, public :: resume => history_resume
    !> Put into a snapshot where the file ends.
    procedure, public :: save => history_save
    !> Declare a column.
    procedure, public :: add_column => history_add_column
    !> The value of a column in the next row.
    procedure, public :: set => history_set
    !> Write the row, and the header before the first.
    procedure, public :: append => history_append
    !> Harmless when nothing is open.
    procedure, public :: close => history_close
  end type history_t

contains

  !> Collective. A file that exists is replaced, unless a snapshot is given: then it is compared
  !> with that, and left alone until `resume`, which follows when the columns are declared.
  subroutine history_open(self, path, comm, units, status, snapshot)
    class(history_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> Gives the labels.
    type(units_t), intent(in) :: units
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when the file cannot be created.
    type(status_t), intent(inout) :: status
    type(snapshot_t), intent(in), optional :: snapshot

    integer :: code

    call self%close()
    self%comm = comm
    self%units = units
    self%path = trim(path)
    allocate (self%columns(0))
    if (present(snapshot)) then
      call check_mark(MARK, self%path, comm, snapshot, status)
      return
    end if
    if (comm%rank == 0) then
      open (newunit=self%unit, file=self%path, status='replace', action='write', iostat=code)
      self%is_open = code == 0
      if (.not. self%is_open) then
        call status%raise(STATUS_ERROR, 'history_open', 'cannot create '//self%path//': '// &
                          describe_refusal(self%path), EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine history_open

  !> Collective. Rows that came after the snapshot are dropped.
  subroutine history_resume(self, snapshot, status)
    class(history_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when the columns are others, or the
    !> file cannot be written.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: header
    integer :: code

    if (self%comm%rank == 0) then
      header = header_of(self%columns)
      if (first_line(self%path, len(header) + 1) /= header) then
        call status%raise(STATUS_ERROR, 'history_resume', self%path//' has other columns than '// &
                          'those of this run: write new results, &restart from with another '// &
                          '&output prefix', EXIT_FILE)
      end if
    end if
    call self%comm%agree(status)
    if (status%failed()) return
    call cut_to_mark(MARK, self%path, self%comm, snapshot, status)
    if (status%failed()) return
    if (self%comm%rank == 0) then
      open (newunit=self%unit, file=self%path, status='old', action='write', position='append', &
            iostat=code)
      self%is_open = code == 0
      if (.not. self%is_open) then
        call status%raise(STATUS_ERROR, 'history_resume', 'cannot write '//self%path//': '// &
                          describe_refusal(self%path), EXIT_FILE)
      end if
    end if
    self%has_header = .true.
    call self%comm%agree(status)

  end subroutine history_resume

  subroutine history_save(self, snapshot)
    class(history_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call mark_file(MARK, self%path, self%comm, snapshot)

  end subroutine history_save

  !> Not collective, but the same on all ranks. All columns come before the first row.
  subroutine history_add_column(self, name, dimension, status)
    class(history_t), intent(inout) :: self
    !> Unique; without commas.
    character(len=*), intent(in) :: name
    !> As `length/time`; the header shows the label of the run's unit system.
    character(len=*), intent(in) :: dimension
    !> `STATUS_ERROR` when the name is taken or useless, the dimension unknown, or rows are written.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: label
    type(column_t), allocatable :: longer(:)
    integer :: n

    n = size(self%columns)
    if (self%has_header) then
      call status%raise(STATUS_ERROR, 'history_add_column', 'column '//trim(name)// &
                        ': comes after the first row', EXIT_FILE)
    else if (name == '' .or. scan(name, ',"') > 0 .or. &
             len_trim(name) > len(self%columns%name)) then
      call status%raise(STATUS_ERROR, 'history_add_column', 'column '//trim(name)// &
                        ': a name has 1 to 64 characters and neither comma nor quote', EXIT_FILE)
    else if (any(self%columns%name == name)) then
      call status%raise(STATUS_ERROR, 'history_add_column', 'column '//trim(name)// &
                        ': declared twice', EXIT_FILE)
    end if
    call self%units%get_label(dimension, label, status)
    if (status%failed()) return

    allocate (longer(n + 1))
    longer(:n) = self%columns
    longer(n + 1)%name = name
    longer(n + 1)%dimension = dimension
    longer(n + 1)%label = label
    call move_alloc(longer, self%columns)

  end subroutine history_add_column

  !> Not collective. A second call for the same row replaces the value.
  subroutine history_set(self, name, value, status)
    class(history_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> In the dimension of the column; absolute temperatures in kelvin.
    real(wp), intent(in) :: value
    !> `STATUS_ERROR` when there is no such column, or the value is not finite.
    type(status_t), intent(inout) :: status

    integer :: i

    i = findloc(self%columns%name == name, .true., dim=1)
    if (i == 0) then
      call status%raise(STATUS_ERROR, 'history_set', 'no column '//trim(name)//' in '// &
                        self%path, EXIT_FILE)
    else if (.not. is_finite(value)) then
      call status%raise(STATUS_ERROR, 'history_set', 'column '//trim(name)//' of '//self%path// &
                        ': the value is not a finite number', EXIT_FILE)
    else
      self%columns(i)%value = value
      self%columns(i)%is_set = .true.
    end if

  end subroutine history_set

  !> Collective. The row is on its way to the disk when the call returns.
  subroutine history_append(self, status)
    class(history_t), intent(inout) :: self
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when rank 0 has not set all columns,
    !> when any rank's `status` had failed, or when the file cannot be written.
    type(status_t), intent(inout) :: status

    integer :: i
    logical :: is_written

    if (self%comm%rank == 0) then
      i = findloc(self%columns%is_set, .false., dim=1)
      if (i > 0) then
        call status%raise(STATUS_ERROR, 'history_append', 'column '//trim(self%columns(i)%name)// &
                          ' of '//self%path//': not set in this row', EXIT_FILE)
      end if
    end if
    call self%comm%agree(status)
    if (status%failed()) return

    is_written = .true.
    if (self%comm%rank == 0) call write_row(self, is_written)
    if (.not. is_written) then
      call status%raise(STATUS_ERROR, 'history_append', 'cannot write '//self%path// &
                        ': the disk may be full', EXIT_FILE)
    end if
    self%has_header = .true.
    self%columns%is_set = .false.
    call self%comm%agree(status)

  end subroutine history_append

  !> Rank 0's part of a row.
  subroutine write_row(self, is_written)
    type(history_t), intent(in) :: self
    !> False when the file refused it.
    logical, intent(out) :: is_written

    character(len=:), allocatable :: row
    integer :: code, i

    row = ''
    do i = 1, size(self%columns)
      associate (column => self%columns(i))
        row = row//','//full_text(shown(column%value, trim(column%dimension)))
      end associate
    end do
    if (.not. self%has_header) row = ','//header_of(self%columns)//new_line('a')//row(2:)
    write (self%unit, '(a)', iostat=code) row(2:)
    if (code == 0) flush (self%unit, iostat=code)
    is_written = code == 0

  end subroutine write_row

  !> Names and labels of all columns.
  function header_of(columns) result(header)
    type(column_t), intent(in) :: columns(:)
    character(len=:), allocatable :: header

    integer :: i

    header = ''
    do i = 1, size(columns)
      if (i > 1) header = header//','
      header = header//trim(columns(i)%name)//' ['//trim(columns(i)%label)//']'
    end do

  end function header_of

  !> The first line of a file, or as much of it as is asked for; empty when there is none.
  function first_line(path, longest) result(line)
    character(len=*), intent(in) :: path
    integer, intent(in) :: longest
    character(len=:), allocatable :: line

    integer :: code, unit

    line = repeat(' ', longest)
    open (newunit=unit, file=path, status='old', action='read', iostat=code)
    if (code /= 0) return
    read (unit, '(a)', iostat=code) line
    close (unit)
    if (code /= 0) line = ''

  end function first_line

  subroutine history_close(self)
    class(history_t), intent(inout) :: self

    if (self%is_open) close (self%unit)
    self%is_open = .false.
    self%has_header = .false.
    if (allocated(self%columns)) deallocate (self%columns)

  end subroutine history_close

  !> The shortest text that reads back as the same number: `12`, `0.1`, `-1.5e20`.
  pure function full_text(value) result(string)
    !> Finite.
    real(wp), intent(in) :: value
    character(len=:), allocatable :: string

    integer, parameter :: FEWEST_DECIMALS = 14
    integer, parameter :: MOST_DECIMALS = 16
    !> A number this large could overflow when it is rounded to fewer decimals.
    real(wp), parameter :: TOO_LARGE_TO_ROUND = 1.0e307_wp
    character(len=32) :: buffer, format
    integer :: exponent, mark, n_decimal
    real(wp) :: again

    if (abs(value) <= 0.0_wp) then
      string = '0'
      return
    end if

    do n_decimal = FEWEST_DECIMALS, MOST_DECIMALS
      if (n_decimal < MOST_DECIMALS .and. abs(value) > TOO_LARGE_TO_ROUND) cycle
      write (format, '(a,i0,a)') '(es32.', n_decimal, 'e3)'
      write (buffer, format) abs(value)
      read (buffer, *) again
      if (abs(again - abs(value)) <= 0.0_wp) exit
    end do
    buffer = adjustl(buffer)
    mark = index(buffer, 'E')
    read (buffer(mark + 1:), *) exponent
    string = decimal_text(buffer(1:1)//buffer(3:mark - 1), exponent)
    if (value < 0.0_wp) string = '-'//string

  end function full_text

  !> A positive number from its digits, the first of which counts `10**exponent`.
  pure function decimal_text(digits, exponent) result(string)
    !> Starts with a digit other than 0.
    character(len=*), intent(in) :: digits
    integer, intent(in) :: exponent
    character(len=:), allocatable :: string

    integer, parameter :: SMALLEST_PLAIN = -4
    integer, parameter :: LARGEST_PLAIN = 14
    character(len=8) :: buffer
    integer :: n

    n = verify(digits, '0', back=.true.)
    if (exponent < SMALLEST_PLAIN .or. exponent > LARGEST_PLAIN) then
      string = digits(1:1)
      if (n > 1) string = string//'.'//digits(2:n)
      write (buffer, '(i0)') exponent
      string = string//'e'//trim(buffer)
    else if (exponent < 0) then
      string = '0.'//repeat('0', -exponent - 1)//digits(:n)
    else if (n <= exponent + 1) then
      string = digits(:n)//repeat('0', exponent + 1 - n)
    else
      string = digits(:exponent + 1)//'.'//digits(exponent + 2:n)
    end if

  end function decimal_text

end module swage_history
