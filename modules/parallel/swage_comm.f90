!> The only module that calls MPI for the others: everything above it talks to a `comm_t`.
module swage_comm
  use, intrinsic :: iso_fortran_env, only: error_unit
  use mpi_f08, only: MPI_Abort, MPI_Allgather, MPI_Allreduce, MPI_Alltoall, MPI_Alltoallv, &
                     MPI_Bcast, MPI_CHARACTER, MPI_Comm, MPI_Comm_rank, MPI_Comm_size, &
                     MPI_DOUBLE_PRECISION, MPI_Exscan, MPI_INTEGER, MPI_INTEGER8, MPI_MAX, &
                     MPI_MIN, MPI_SUM
  use swage_kinds, only: gp, wp
  use swage_status, only: status_t, STATUS_OK
  implicit none(type, external)
  private

  public :: comm_t, comm_create

  !> A communicator together with this rank's place in it. Holds no resource: copy it freely.
  type :: comm_t
    type(MPI_Comm) :: handle
    integer :: rank = 0
    integer :: size = 1
  contains
    !> Collective. Give every rank the same, worst status.
    procedure :: agree => comm_agree
    !> Collective. Rank 0's value for everyone.
    generic :: broadcast => broadcast_integer, broadcast_integers, broadcast_reals, broadcast_text
    !> Collective. Where this rank's items lie in the list of all ranks' items.
    procedure :: locate => comm_locate
    !> Collective. Sum over the ranks, in place; the result is the same on all of them.
    generic :: sum => sum_real, sum_reals, sum_count, sum_counts
    !> Collective. Largest value of all ranks, in place.
    generic :: max => max_real, max_integer
    !> Collective. Smallest value of all ranks, in place.
    generic :: min => min_real, min_count
    !> Collective. One integer of each rank, for all ranks.
    procedure :: gather_all => comm_gather_all
    !> Collective. Send a part of a list to each rank, receive one from each.
    generic :: exchange => exchange_counts, exchange_integers, exchange_longs, exchange_reals
    !> Print the status and end all ranks. Only a main program calls this.
    procedure :: abort => comm_abort
    procedure, private :: broadcast_integer
    procedure, private :: broadcast_integers
    procedure, private :: broadcast_reals
    procedure, private :: broadcast_text
    procedure, private :: sum_real
    procedure, private :: sum_reals
    procedure, private :: sum_count
    procedure, private :: sum_counts
    procedure, private :: max_real
    procedure, private :: max_integer
    procedure, private :: min_real
    procedure, private :: min_count
    procedure, private :: exchange_counts
    procedure, private :: exchange_integers
    procedure, private :: exchange_longs
    procedure, private :: exchange_reals
  end type comm_t

contains

  !> Wrap an MPI communicator that the caller owns and outlives the result.
  function comm_create(handle) result(comm)
    type(MPI_Comm), intent(in) :: handle
    type(comm_t) :: comm

    comm%handle = handle
    call MPI_Comm_rank(handle, comm%rank)
    call MPI_Comm_size(handle, comm%size)

  end function comm_create

  !> Collective. Afterwards all ranks hold the worst severity present on any of them, with the
  !> exit code, origin and message of the lowest rank that had it; so all of them branch the same
  !> way and none is left waiting in the next collective.
  subroutine comm_agree(self, status)
    class(comm_t), intent(in) :: self
    !> This rank's outcome on entry, the common one on return.
    type(status_t), intent(inout) :: status

    integer :: mine, source, worst

    call MPI_Allreduce(status%severity, worst, 1, MPI_INTEGER, MPI_MAX, self%handle)
    if (worst == STATUS_OK) return

    mine = merge(self%rank, self%size, status%severity == worst)
    call MPI_Allreduce(mine, source, 1, MPI_INTEGER, MPI_MIN, self%handle)
    call MPI_Bcast(status%exit_code, 1, MPI_INTEGER, source, self%handle)
    call MPI_Bcast(status%origin, len(status%origin), MPI_CHARACTER, source, self%handle)
    call MPI_Bcast(status%message, len(status%message), MPI_CHARACTER, source, self%handle)
    status%severity = worst

  end subroutine comm_agree

  subroutine broadcast_integer(self, value)
    class(comm_t), intent(in) :: self
    integer, intent(inout) :: value

    call MPI_Bcast(value, 1, MPI_INTEGER, 0, self%handle)

  end subroutine broadcast_integer

  !> Every rank passes an array of the same size.
  subroutine broadcast_integers(self, values)
    class(comm_t), intent(in) :: self
    integer, contiguous, intent(inout) :: values(:)

    call MPI_Bcast(values, size(values), MPI_INTEGER, 0, self%handle)

  end subroutine broadcast_integers

  !> Every rank passes an array of the same size.
  subroutine broadcast_reals(self, values)
    class(comm_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: values(:)

    call MPI_Bcast(values, size(values), MPI_DOUBLE_PRECISION, 0, self%handle)

  end subroutine broadcast_reals

  !> The length is that of rank 0; the others need not have allocated theirs.
  subroutine broadcast_text(self, value)
    class(comm_t), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: value

    integer :: length

    length = 0
    if (self%rank == 0) length = len(value)
    call MPI_Bcast(length, 1, MPI_INTEGER, 0, self%handle)
    if (self%rank /= 0) then
      if (allocated(value)) deallocate (value)
      allocate (character(len=length) :: value)
    end if
    if (length > 0) call MPI_Bcast(value, length, MPI_CHARACTER, 0, self%handle)

  end subroutine broadcast_text

  subroutine comm_locate(self, n_local, n_before, n_total)
    class(comm_t), intent(in) :: self
    !> Items on this rank.
    integer(gp), intent(in) :: n_local
    !> Items on lower ranks.
    integer(gp), intent(out) :: n_before
    !> Items on all ranks.
    integer(gp), intent(out) :: n_total

    n_before = 0_gp
    call MPI_Exscan(n_local, n_before, 1, MPI_INTEGER8, MPI_SUM, self%handle)
    if (self%rank == 0) n_before = 0_gp
    call MPI_Allreduce(n_local, n_total, 1, MPI_INTEGER8, MPI_SUM, self%handle)

  end subroutine comm_locate

  subroutine sum_real(self, value)
    class(comm_t), intent(in) :: self
    real(wp), intent(inout) :: value

    real(wp) :: total

    call MPI_Allreduce(value, total, 1, MPI_DOUBLE_PRECISION, MPI_SUM, self%handle)
    value = total

  end subroutine sum_real

  subroutine sum_reals(self, values)
    class(comm_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: values(:)

    real(wp) :: total(size(values))

    call MPI_Allreduce(values, total, size(values), MPI_DOUBLE_PRECISION, MPI_SUM, self%handle)
    values = total

  end subroutine sum_reals

  subroutine sum_count(self, value)
    class(comm_t), intent(in) :: self
    integer(gp), intent(inout) :: value

    integer(gp) :: total

    call MPI_Allreduce(value, total, 1, MPI_INTEGER8, MPI_SUM, self%handle)
    value = total

  end subroutine sum_count

  subroutine sum_counts(self, values)
    class(comm_t), intent(in) :: self
    integer(gp), contiguous, intent(inout) :: values(:)

    integer(gp) :: total(size(values))

    call MPI_Allreduce(values, total, size(values), MPI_INTEGER8, MPI_SUM, self%handle)
    values = total

  end subroutine sum_counts

  subroutine max_real(self, value)
    class(comm_t), intent(in) :: self
    real(wp), intent(inout) :: value

    real(wp) :: largest

    call MPI_Allreduce(value, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, self%handle)
    value = largest

  end subroutine max_real

  subroutine max_integer(self, value)
    class(comm_t), intent(in) :: self
    integer, intent(inout) :: value

    integer :: largest

    call MPI_Allreduce(value, largest, 1, MPI_INTEGER, MPI_MAX, self%handle)
    value = largest

  end subroutine max_integer

  subroutine min_real(self, value)
    class(comm_t), intent(in) :: self
    real(wp), intent(inout) :: value

    real(wp) :: smallest

    call MPI_Allreduce(value, smallest, 1, MPI_DOUBLE_PRECISION, MPI_MIN, self%handle)
    value = smallest

  end subroutine min_real

  subroutine min_count(self, value)
    class(comm_t), intent(in) :: self
    integer(gp), intent(inout) :: value

    integer(gp) :: smallest

    call MPI_Allreduce(value, smallest, 1, MPI_INTEGER8, MPI_MIN, self%handle)
    value = smallest

  end subroutine min_count

  subroutine comm_gather_all(self, mine, all_ranks)
    class(comm_t), intent(in) :: self
    integer, intent(in) :: mine
    !> Shape (0:size - 1).
    integer, allocatable, intent(out) :: all_ranks(:)

    allocate (all_ranks(0:self%size - 1))
    call MPI_Allgather(mine, 1, MPI_INTEGER, all_ranks, 1, MPI_INTEGER, self%handle)

  end subroutine comm_gather_all

  !> Tell each rank how many items it will get from this one.
  subroutine exchange_counts(self, sent, received)
    class(comm_t), intent(in) :: self
    !> Shape (0:size - 1).
    integer, contiguous, intent(in) :: sent(0:)
    !> Shape (0:size - 1).
    integer, contiguous, intent(out) :: received(0:)

    call MPI_Alltoall(sent, 1, MPI_INTEGER, received, 1, MPI_INTEGER, self%handle)

  end subroutine exchange_counts

  !> Lists are ordered by rank, of the receiver when sent, of the sender when received.
  subroutine exchange_integers(self, sent, n_sent, received, n_received)
    class(comm_t), intent(in) :: self
    integer, contiguous, intent(in) :: sent(:)
    !> Items for each rank; shape (0:size - 1).
    integer, contiguous, intent(in) :: n_sent(0:)
    !> Shape (sum(n_received)).
    integer, contiguous, intent(out) :: received(:)
    !> Items from each rank; shape (0:size - 1).
    integer, contiguous, intent(in) :: n_received(0:)

    call MPI_Alltoallv(sent, n_sent, offsets(n_sent), MPI_INTEGER, received, n_received, &
                       offsets(n_received), MPI_INTEGER, self%handle)

  end subroutine exchange_integers

  !> The same for long integers.
  subroutine exchange_longs(self, sent, n_sent, received, n_received)
    class(comm_t), intent(in) :: self
    integer(gp), contiguous, intent(in) :: sent(:)
    integer, contiguous, intent(in) :: n_sent(0:)
    integer(gp), contiguous, intent(out) :: received(:)
    integer, contiguous, intent(in) :: n_received(0:)

    call MPI_Alltoallv(sent, n_sent, offsets(n_sent), MPI_INTEGER8, received, n_received, &
                       offsets(n_received), MPI_INTEGER8, self%handle)

  end subroutine exchange_longs

  !> The same for real numbers.
  subroutine exchange_reals(self, sent, n_sent, received, n_received)
    class(comm_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: sent(:)
    integer, contiguous, intent(in) :: n_sent(0:)
    real(wp), contiguous, intent(out) :: received(:)
    integer, contiguous, intent(in) :: n_received(0:)

    call MPI_Alltoallv(sent, n_sent, offsets(n_sent), MPI_DOUBLE_PRECISION, received, n_received, &
                       offsets(n_received), MPI_DOUBLE_PRECISION, self%handle)

  end subroutine exchange_reals

  !> Not collective, does not return.
  subroutine comm_abort(self, status)
    class(comm_t), intent(in) :: self
    type(status_t), intent(in) :: status

    write (error_unit, '(a,i0,4a)') 'rank ', self%rank, ', ', trim(status%origin), ': ', &
      trim(status%message)
    flush (error_unit)
    call MPI_Abort(self%handle, status%exit_code)

  end subroutine comm_abort

  !> Items before those of each rank.
  pure function offsets(counts) result(before)
    integer, intent(in) :: counts(0:)
    integer :: before(0:size(counts) - 1)

    integer :: i

    before(0) = 0
    do i = 1, size(counts) - 1
      before(i) = before(i - 1) + counts(i - 1)
    end do

  end function offsets

end module swage_comm
