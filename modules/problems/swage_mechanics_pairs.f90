!> What [[swage_mechanics]] does where bodies may touch each other.
!>
!> Every rank knows the surfaces, and has the conditions of the slave nodes it owns; forces are
!> added over the ranks, and the stiffness goes to the coupling part of the matrix.
submodule(swage_mechanics) swage_mechanics_pairs
  use swage_coupling_matrix, only: coupling_matrix_t
  implicit none(type, external)

  !> Weight of the conditions of a surface that meets itself: both of its walls have them.
  real(wp), parameter :: SELF_WEIGHT = 0.5_wp

contains

  module procedure begin_pairs

    real(wp), allocatable :: on_surface(:, :)
    integer :: i

    allocate (on_surface(1, self%surface%n_node))
    call self%surface%gather(self%positions(), self%surface_start)
    call self%surface%gather(flow_stress, on_surface)
    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i))
        if (pair%contact%is_tied) then
          call pair%contact%tie%begin_step(self%surface_start, pair%rows)
        else
          call pair%surfaces%begin_step(self%surface_start)
          call find_conditions(self, pair)
        end if
        call pair%contact%set_times(self%time, self%time_new)
        pair%contact%inertia%is_steady = self%carries .and. self%dt_last > 0.0_wp &
          .and. .not. self%changes_course(self%time)
        call pair%contact%begin_step(pair%rows, on_surface(1, :))
      end associate
    end do

  end procedure begin_pairs

  module procedure evaluate_pairs

    real(wp), allocatable, target :: force(:, :)
    real(wp), allocatable :: increment(:, :)
    real(wp), pointer :: list(:)
    integer :: i, n

    call self%surface%gather(moved, self%surface_moved)
    if (any(self%pairs%contact%is_tied)) then
      allocate (increment(3, self%surface%n_node))
      call self%surface%gather(self%increment, increment)
      do i = 1, size(self%pairs)
        associate (pair => self%pairs(i))
          if (pair%contact%is_tied) call pair%contact%tie%update(increment, pair%rows)
        end associate
      end do
    end if
    allocate (force(3, self%surface%n_node), source=0.0_wp)
    do i = 1, size(self%pairs)
      call evaluate_pair(self, self%pairs(i), force)
    end do
    call add_stiffness(self)
    list(1:size(force)) => force
    call self%comm%sum(list)
    n = self%mesh%dimension
    do i = 1, self%surface%n_node
      if (.not. self%surface%is_own(i)) cycle
      associate (node => self%unknowns%of_node(self%surface%mesh_node(i)))
        self%residual(:n, node) = self%residual(:n, node) + force(:n, i)
      end associate
      self%contact_force_new(:, self%surface%mesh_node(i)) = force(:n, i)
    end do

  end procedure evaluate_pairs

  subroutine find_conditions(self, pair)
    class(mechanics_t), intent(in) :: self
    type(body_pair_t), intent(inout) :: pair

    call pair%formulation%evaluate(pair%surfaces, self%surface%is_own, pair%rows)
    if (pair%surfaces%is_self) call pair%rows%scale(SELF_WEIGHT)

  end subroutine find_conditions

  !> Conditions, forces and stiffness of one pair.
  subroutine evaluate_pair(self, pair, force)
    class(mechanics_t), intent(in) :: self
    type(body_pair_t), intent(inout) :: pair
    !> Of the nodes of the surfaces, with the sign of the residual; added to.
    real(wp), intent(inout) :: force(:, :)

    type(contact_blocks_t) :: turning
    real(wp) :: weight
    integer :: i

    if (.not. pair%contact%is_tied) then
      call pair%surfaces%update(self%surface_moved)
      call find_conditions(self, pair)
    end if
    call pair%blocks%start()
    call pair%unsymmetric%start()
    call pair%contact%evaluate(pair%rows, self%surface_start, self%surface_moved, &
                               self%time_new - self%time, self%slip_rate, force, pair%blocks, &
                               pair%unsymmetric)
    if (pair%contact%is_tied) return
    weight = 1.0_wp
    if (pair%surfaces%is_self) then
      ! A formulation knows the rows as it has made them
      weight = SELF_WEIGHT
      call pair%rows%scale(1.0_wp / weight)
    end if
    call pair%formulation%stiffness(pair%surfaces, pair%rows, &
                                    pair%contact%row_pressure(:pair%rows%n_row), turning)
    ! The residual has the forces with the opposite sign
    do i = 1, turning%n
      call pair%blocks%add(turning%row(i), turning%column(i), -weight * turning%block(:, :, i))
    end do
    if (pair%surfaces%is_self) call pair%rows%scale(weight)

  end subroutine evaluate_pair

  !> Collective. The blocks of all pairs, into the matrix.
  subroutine add_stiffness(self)
    class(mechanics_t), intent(inout) :: self

    integer, allocatable :: columns(:), rows(:)
    integer :: i, n

    n = 0
    do i = 1, size(self%pairs)
      n = n + self%pairs(i)%blocks%n + self%pairs(i)%unsymmetric%n
    end do
    allocate (rows(n), columns(n))
    n = 0
    do i = 1, size(self%pairs)
      call list_blocks(self%pairs(i)%blocks, n, rows, columns)
      call list_blocks(self%pairs(i)%unsymmetric, n, rows, columns)
    end do
    call self%matrix%coupling%expect(rows, columns)
    do i = 1, size(self%pairs)
      call add_blocks(self%pairs(i)%blocks, .false., self%matrix%coupling)
      call add_blocks(self%pairs(i)%unsymmetric, .true., self%matrix%coupling)
    end do

  end subroutine add_stiffness

  !> Append the places of blocks to lists.
  pure subroutine list_blocks(blocks, n, rows, columns)
    type(contact_blocks_t), intent(in) :: blocks
    !> Places so far.
    integer, intent(inout) :: n
    integer, intent(inout) :: rows(:)
    integer, intent(inout) :: columns(:)

    if (blocks%n == 0) return
    rows(n + 1:n + blocks%n) = blocks%row(:blocks%n)
    columns(n + 1:n + blocks%n) = blocks%column(:blocks%n)
    n = n + blocks%n

  end subroutine list_blocks

  pure subroutine add_blocks(blocks, is_unsymmetric, coupling)
    type(contact_blocks_t), intent(in) :: blocks
    logical, intent(in) :: is_unsymmetric
    type(coupling_matrix_t), intent(inout) :: coupling

    integer :: i

    do i = 1, blocks%n
      call coupling%add(blocks%row(i), blocks%column(i), blocks%block(:, :, i), is_unsymmetric)
    end do

  end subroutine add_blocks

  module procedure constrain_coupling

    integer, allocatable :: n_direction(:)
    real(wp), allocatable :: axes(:, :, :)
    integer :: i, j, n

    n = self%mesh%dimension
    allocate (axes(n, n, self%unknowns%n_node), source=0.0_wp)
    do j = 1, n
      axes(j, j, :) = 1.0_wp
    end do
    allocate (n_direction(self%unknowns%n_node), source=0)
    do i = 1, self%constraints%n_constrained
      associate (node => self%constraints%node(i))
        n_direction(node) = self%constraints%n_direction(i)
        axes(:, :, node) = self%constraints%axes(:, :, i)
      end associate
    end do
    call self%matrix%coupling%impose(n_direction, axes, rest, load)

  end procedure constrain_coupling

end submodule swage_mechanics_pairs
