!> Results as files of one step each, `case_0001.hdf` and on, with an index that ParaView opens as
!> one series: `case.hdf.series`. ParaView 5.11 knows VTKHDF by this ending only.
!>
!> A step is written under a passing name. When it is whole it gets its own, then the index is
!> replaced: whenever a run is killed, the index names whole files only.
!> Source: ParaView user's guide, file series.
module swage_result_series
  use swage_comm, only: comm_t
  use swage_file_system, only: remove_file, rename_file
  use swage_history, only: full_text
  use swage_kinds, only: wp
  use swage_output_path, only: describe_refusal
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  implicit none(type, external)
  private

  public :: result_series_t, remove_series, INDEX_END

  !> Ends of the names of files, of the index and of what is not whole.
  character(len=*), parameter :: FILE_END = '.hdf'
  character(len=*), parameter :: INDEX_END = '.hdf.series'
  character(len=*), parameter :: PASSING_END = '.part'

  !> What precedes the time in a line of the index; each file has a line.
  character(len=*), parameter :: BEFORE_TIME = '"time": '

  !> The files of a run. `resume` and `add` are collective.
  type :: result_series_t
    private
    type(comm_t) :: comm
    character(len=:), allocatable :: prefix
    !> Of the files in the index [time]; shape (n_file).
    real(wp), allocatable :: times(:)
  contains
    !> Start a series; one of the same prefix is removed.
    procedure, public :: open => result_series_open
    !> Go on behind the files that there were when a snapshot was taken.
    procedure, public :: resume => result_series_resume
    !> Put the times of the files into a snapshot.
    procedure, public :: save => result_series_save
    !> Where to write the next file.
    procedure, public :: next_path => result_series_next_path
    !> Give the file that has been written and closed its name, and name it in the index.
    procedure, public :: add => result_series_add
  end type result_series_t

contains

  subroutine result_series_open(self, prefix, comm)
    class(result_series_t), intent(inout) :: self
    !> Start of the names of all files.
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm

    self%comm = comm
    self%prefix = prefix
    self%times = [real(wp) ::]
    call remove_series(prefix, comm)

  end subroutine result_series_open

  subroutine result_series_save(self, snapshot)
    class(result_series_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('results: times of files', self%times)

  end subroutine result_series_save

  !> Files that came later stay until others take their names, but leave the index.
  subroutine result_series_resume(self, prefix, comm, snapshot, status)
    class(result_series_t), intent(inout) :: self
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when a file of the snapshot is gone
    !> or the index cannot be written.
    type(status_t), intent(inout) :: status

    integer :: i
    logical :: is_there

    self%comm = comm
    self%prefix = prefix
    allocate (self%times(snapshot%count('results: times of files')))
    call snapshot%get('results: times of files', self%times, status)
    if (comm%rank == 0 .and. .not. status%failed()) then
      do i = 1, size(self%times)
        inquire (file=path_of(self%prefix, i), exist=is_there)
        if (is_there) cycle
        call status%raise(STATUS_ERROR, 'result_series_resume', path_of(self%prefix, i)// &
                          ' does not belong to the restart file: there is no such file. '// &
                          'Bring the file back, or write new results: &restart from with '// &
                          'another &output prefix', EXIT_FILE)
        exit
      end do
      if (.not. status%failed()) call write_index(self, status)
    end if
    call comm%agree(status)

  end subroutine result_series_resume

  pure function result_series_next_path(self) result(path)
    class(result_series_t), intent(in) :: self
    character(len=:), allocatable :: path

    path = path_of(self%prefix, size(self%times) + 1)//PASSING_END

  end function result_series_next_path

  subroutine result_series_add(self, time, status)
    class(result_series_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when a name cannot be given or the
    !> index cannot be written.
    type(status_t), intent(inout) :: status

    logical :: succeeded

    if (self%comm%rank == 0 .and. .not. status%failed()) then
      call rename_file(self%next_path(), path_of(self%prefix, size(self%times) + 1), succeeded)
      if (.not. succeeded) then
        call status%raise(STATUS_ERROR, 'result_series_add', self%next_path()// &
                          ' cannot get the name of its step', EXIT_FILE)
      end if
    end if
    self%times = [self%times, time]
    if (self%comm%rank == 0 .and. .not. status%failed()) call write_index(self, status)
    call self%comm%agree(status)

  end subroutine result_series_add

  !> Remove the files that an index names, and the index first. Rank 0 does it.
  subroutine remove_series(prefix, comm)
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm

    character(len=1024) :: line
    integer :: code, i, n, unit

    if (comm%rank /= 0) return
    n = 0
    open (newunit=unit, file=prefix//INDEX_END, status='old', action='read', iostat=code)
    if (code /= 0) return
    do
      read (unit, '(a)', iostat=code) line
      if (code /= 0) exit
      if (index(line, BEFORE_TIME) > 0) n = n + 1
    end do
    close (unit)
    call remove_file(prefix//INDEX_END)
    do i = 1, n
      call remove_file(path_of(prefix, i))
    end do

  end subroutine remove_series

  !> Replace the index. Only rank 0 calls.
  subroutine write_index(self, status)
    class(result_series_t), intent(in) :: self
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: path
    integer :: code, i, unit
    logical :: succeeded

    path = self%prefix//INDEX_END
    open (newunit=unit, file=path//PASSING_END, status='replace', action='write', iostat=code)
    if (code == 0) then
      write (unit, '(a)', iostat=code) '{', '  "file-series-version": "1.0",', '  "files": ['
      do i = 1, size(self%times)
        if (code /= 0) exit
        write (unit, '(a)', iostat=code) &
          '    {"name": "'//quoted(path_of(self%prefix, i))//'", '//BEFORE_TIME// &
          full_text(self%times(i))//trim(merge('},', '} ', i < size(self%times)))
      end do
      if (code == 0) write (unit, '(a)', iostat=code) '  ]', '}'
      if (code == 0) flush (unit, iostat=code)
      close (unit)
    end if
    succeeded = code == 0
    if (succeeded) call rename_file(path//PASSING_END, path, succeeded)
    if (.not. succeeded) then
      call status%raise(STATUS_ERROR, 'write_index', 'cannot write '//path//': '// &
                        describe_refusal(path), EXIT_FILE)
    end if

  end subroutine write_index

  !> Name of a file of a series.
  pure function path_of(prefix, number) result(path)
    character(len=*), intent(in) :: prefix
    !> From 1.
    integer, intent(in) :: number
    character(len=:), allocatable :: path

    character(len=12) :: digits

    write (digits, '(i0.4)') number
    path = prefix//'_'//trim(digits)//FILE_END

  end function path_of

  !> The name of a path without its folder, as JSON wants a text.
  pure function quoted(path) result(name)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: name

    integer :: i

    name = ''
    do i = index(path, '/', back=.true.) + 1, len(path)
      if (scan(path(i:i), '"\') > 0) name = name//'\'
      name = name//path(i:i)
    end do

  end function quoted

end module swage_result_series
