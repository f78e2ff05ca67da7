!> The facade for C; `swage.h` says what each function does.
module swage_c
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int, &
                                         c_loc, c_null_char, c_null_ptr, c_ptr, c_size_t
  use swage_comm, only: comm_t
  use swage_environment, only: comm_of_handle, environment_start, environment_stop
  use swage_kinds, only: wp
  use swage_simulation, only: simulation_t
  use swage_status, only: status_t, EXIT_INPUT, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: c_environment_start, c_environment_stop, c_start, c_advance, c_advance_to, c_run
  public :: c_write, c_field_shape, c_field, c_time, c_end, c_increment, c_is_done, c_message
  public :: c_finish

  !> What a `swage_simulation *` points to.
  type :: run_t
    type(simulation_t) :: simulation
    type(status_t) :: status
    !> The message, ended by a null.
    character(kind=c_char, len=1) :: message(1025) = c_null_char
  end type run_t

  interface
    !> C: length of a text.
    pure function c_strlen(string) result(length) bind(C, name='strlen')
      import :: c_ptr, c_size_t
      implicit none(type, external)
      type(c_ptr), value, intent(in) :: string
      integer(c_size_t) :: length
    end function c_strlen
  end interface

contains

  function c_environment_start() result(handle) bind(C, name='swage_environment_start')
    integer(c_int) :: handle

    type(comm_t) :: comm

    call environment_start(comm)
    handle = int(comm%handle%mpi_val, c_int)

  end function c_environment_start

  subroutine c_environment_stop() bind(C, name='swage_environment_stop')

    call environment_stop()

  end subroutine c_environment_stop

  function c_start(path, prefix, comm, run) result(code) bind(C, name='swage_start')
    type(c_ptr), value, intent(in) :: path
    type(c_ptr), value, intent(in) :: prefix
    integer(c_int), value, intent(in) :: comm
    type(c_ptr), intent(out) :: run
    integer(c_int) :: code

    type(run_t), pointer :: made

    allocate (made)
    run = c_loc(made)
    if (c_associated(prefix)) then
      call made%simulation%start(text_of(path), comm_of_handle(int(comm)), made%status, &
                                 prefix=text_of(prefix))
    else
      call made%simulation%start(text_of(path), comm_of_handle(int(comm)), made%status)
    end if
    code = code_of(made)

  end function c_start

  function c_advance(run) result(code) bind(C, name='swage_advance')
    type(c_ptr), value, intent(in) :: run
    integer(c_int) :: code

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    if (.not. known%status%failed()) call known%simulation%advance(known%status)
    code = code_of(known)

  end function c_advance

  function c_advance_to(run, time) result(code) bind(C, name='swage_advance_to')
    type(c_ptr), value, intent(in) :: run
    real(c_double), value, intent(in) :: time
    integer(c_int) :: code

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    if (.not. known%status%failed()) then
      call known%simulation%advance_to(real(time, wp), known%status)
    end if
    code = code_of(known)

  end function c_advance_to

  function c_run(run) result(code) bind(C, name='swage_run')
    type(c_ptr), value, intent(in) :: run
    integer(c_int) :: code

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    if (.not. known%status%failed()) call known%simulation%run(known%status)
    code = code_of(known)

  end function c_run

  function c_write(run) result(code) bind(C, name='swage_write')
    type(c_ptr), value, intent(in) :: run
    integer(c_int) :: code

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    if (.not. known%status%failed()) call known%simulation%write(known%status)
    code = code_of(known)

  end function c_write

  !> A field that does not exist is no end of the run.
  function c_field_shape(run, name, n_component, n_item) result(code) &
    bind(C, name='swage_field_shape')
    type(c_ptr), value, intent(in) :: run
    type(c_ptr), value, intent(in) :: name
    integer(c_int), intent(out) :: n_component
    integer(c_int), intent(out) :: n_item
    integer(c_int) :: code

    real(wp), allocatable :: values(:, :)
    type(run_t), pointer :: known
    type(status_t) :: status

    n_component = 0_c_int
    n_item = 0_c_int
    call c_f_pointer(run, known)
    call known%simulation%get_field(text_of(name), values, status)
    if (.not. status%failed()) then
      n_component = size(values, 1, kind=c_int)
      n_item = size(values, 2, kind=c_int)
    end if
    code = code_of_query(known, status)

  end function c_field_shape

  function c_field(run, name, values, n) result(code) bind(C, name='swage_field')
    type(c_ptr), value, intent(in) :: run
    type(c_ptr), value, intent(in) :: name
    integer(c_int), value, intent(in) :: n
    real(c_double), intent(inout) :: values(n)
    integer(c_int) :: code

    real(wp), allocatable :: found(:, :)
    type(run_t), pointer :: known
    type(status_t) :: status

    call c_f_pointer(run, known)
    call known%simulation%get_field(text_of(name), found, status)
    if (.not. status%failed()) then
      if (product(shape(found)) == int(n)) then
        values = reshape(found, [n])
      else
        call status%raise(STATUS_ERROR, 'swage_field', 'field '''//text_of(name)//''' has '// &
                          text(product(shape(found)))//' numbers here, room is for '// &
                          text(int(n)), EXIT_INPUT)
      end if
    end if
    code = code_of_query(known, status)

  end function c_field

  function c_time(run) result(time) bind(C, name='swage_time')
    type(c_ptr), value, intent(in) :: run
    real(c_double) :: time

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    time = real(known%simulation%get_time(), c_double)

  end function c_time

  function c_end(run) result(time) bind(C, name='swage_end')
    type(c_ptr), value, intent(in) :: run
    real(c_double) :: time

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    time = real(known%simulation%get_end(), c_double)

  end function c_end

  function c_increment(run) result(n_increment) bind(C, name='swage_increment')
    type(c_ptr), value, intent(in) :: run
    integer(c_int) :: n_increment

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    n_increment = int(known%simulation%get_increment(), c_int)

  end function c_increment

  function c_is_done(run) result(done) bind(C, name='swage_is_done')
    type(c_ptr), value, intent(in) :: run
    integer(c_int) :: done

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    done = merge(1_c_int, 0_c_int, known%simulation%is_done())

  end function c_is_done

  function c_message(run) result(message) bind(C, name='swage_message')
    type(c_ptr), value, intent(in) :: run
    type(c_ptr) :: message

    type(run_t), pointer :: known

    call c_f_pointer(run, known)
    message = c_loc(known%message)

  end function c_message

  function c_finish(run) result(code) bind(C, name='swage_finish')
    type(c_ptr), intent(inout) :: run
    integer(c_int) :: code

    type(run_t), pointer :: known

    code = 0_c_int
    if (.not. c_associated(run)) return
    call c_f_pointer(run, known)
    call known%simulation%finish(known%status)
    code = code_of(known)
    deallocate (known)
    run = c_null_ptr

  end function c_finish

  !> How the run stands, for the caller; its message is kept.
  function code_of(run) result(code)
    type(run_t), intent(inout) :: run
    integer(c_int) :: code

    code = code_of_query(run, run%status)

  end function code_of

  !> The same for a status that is not that of the run.
  function code_of_query(run, status) result(code)
    type(run_t), intent(inout) :: run
    type(status_t), intent(in) :: status
    integer(c_int) :: code

    integer :: i

    code = 0_c_int
    run%message = c_null_char
    if (.not. status%failed()) return
    code = int(status%exit_code, c_int)
    do i = 1, min(len_trim(status%message), size(run%message) - 1)
      run%message(i) = status%message(i:i)
    end do

  end function code_of_query

  !> A text of C, which ends with a null.
  function text_of(string) result(copy)
    type(c_ptr), intent(in) :: string
    character(len=:), allocatable :: copy

    character(kind=c_char, len=1), pointer :: letters(:)
    integer :: i, n

    n = int(c_strlen(string))
    call c_f_pointer(string, letters, [n])
    allocate (character(len=n) :: copy)
    do i = 1, n
      copy(i:i) = letters(i)
    end do

  end function text_of

end module swage_c
