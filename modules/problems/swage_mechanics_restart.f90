!> What [[swage_mechanics]] keeps for the next step of a run that goes on later.
!>
!> Saved is what an accepted step leaves behind; what is made from the input and the mesh is made
!> again.
submodule(swage_mechanics) swage_mechanics_restart
  use swage_checksum, only: bytes_of, checksum
  use swage_linear_solver, only: SOLVER_SAVED
  use swage_snapshot, only: OF_CELLS, OF_NODES, OF_SOME_NODES, snapshot_create
  implicit none(type, external)

  !> Entry of a snapshot with the further pressures of nodes where materials meet.
  character(len=*), parameter :: FURTHER = 'further pressures'

contains

  module procedure mechanics_start_snapshot

    associate (mesh => self%mesh)
      call snapshot_create(mesh%n_own_node, mesh%node_tag, mesh%cell_tag, snapshot)
    end associate
    call snapshot%identify('units', self%units)
    call snapshot%identify('dimension', kind_text(self%settings))
    call snapshot%identify('mesh', mesh_text(self))
    call snapshot%identify('bodies', body_names(self))
    call snapshot%identify('histories', history_names(self))
    call snapshot%identify('boundaries', boundary_names(self))
    call snapshot%identify('tools', tool_names(self))
    call snapshot%identify('contacts', contact_names(self))

  end procedure mechanics_start_snapshot

  module procedure mechanics_save

    integer :: i

    call snapshot%put('time', self%time)
    call snapshot%put('last dt', self%dt_last)
    call snapshot%put('dt before', self%dt_before)
    call snapshot%put('recommended dt', self%recommended_step)
    call snapshot%put('coordinates', self%mesh%coordinates, OF_NODES)
    call snapshot%put('displacement', self%displacement, OF_NODES)
    call snapshot%put('last increment', self%increment_last, OF_NODES)
    call snapshot%put('increment before', self%increment_before, OF_NODES)
    associate (node => self%unknowns%of_node)
      call snapshot%put('pressure', self%pressure(node), OF_NODES)
      call snapshot%put('last pressure', self%pressure_last(node), OF_NODES)
      call snapshot%put('pressure before', self%pressure_before(node), OF_NODES)
    end associate
    if (self%unknowns%n_further_global > 0_gp) call save_further(self, snapshot)
    call snapshot%put('temperature', self%temperature, OF_NODES)
    call snapshot%put('deviator', self%deviator, OF_CELLS)
    call snapshot%put('log volume', self%log_volume, OF_CELLS)
    call snapshot%put('volume', self%volume_new, OF_CELLS)
    call snapshot%put('state', self%state, OF_CELLS)
    call snapshot%put('mean stress', self%mean_stress_old, OF_CELLS)
    call snapshot%put('bubble modulus', self%bubble_modulus, OF_CELLS)
    call snapshot%put('relaxation', self%relaxation, OF_CELLS)
    call snapshot%put('flow stress', self%flow_stress, OF_CELLS)
    call snapshot%put('largest force scale', self%largest_force_scale)
    call snapshot%put('carried force', self%carried_force)
    call snapshot%put('carries', self%carries)
    call self%energies%save(snapshot)
    call snapshot%put('support force', self%support_force, OF_NODES)
    if (size(self%pairs) > 0) call snapshot%put('contact force', self%contact_force, OF_NODES)
    call snapshot%put('tool force', self%tool_force)
    call snapshot%put('reaction', self%reaction)
    call snapshot%put('load force', self%load_force)
    do i = 1, size(self%contacts)
      call self%contacts(i)%save(snapshot)
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%save(snapshot)
      if (self%pairs(i)%surfaces%is_self) call save_walls(self, self%pairs(i), snapshot)
    end do
    do i = 1, size(self%tools)
      call self%tools(i)%save(snapshot)
    end do
    if (size(self%pairs) > 0) call self%matrix%coupling%save(snapshot)
    if (allocated(self%solver)) call self%solver%save(snapshot)

  end procedure mechanics_save

  module procedure mechanics_load

    integer :: i

    call snapshot%get('time', self%time, status)
    call snapshot%get('last dt', self%dt_last, status)
    call snapshot%get('dt before', self%dt_before, status)
    call snapshot%get('recommended dt', self%recommended_step, status)
    call snapshot%get('coordinates', self%mesh%coordinates, status, OF_NODES)
    call snapshot%get('displacement', self%displacement, status, OF_NODES)
    call snapshot%get('last increment', self%increment_last, status, OF_NODES)
    call snapshot%get('increment before', self%increment_before, status, OF_NODES)
    call load_pressure('pressure', self%pressure)
    call load_pressure('last pressure', self%pressure_last)
    call load_pressure('pressure before', self%pressure_before)
    if (self%unknowns%n_further_global > 0_gp) call load_further(self, snapshot, status)
    call snapshot%get('temperature', self%temperature, status, OF_NODES)
    call snapshot%get('deviator', self%deviator, status, OF_CELLS)
    call snapshot%get('log volume', self%log_volume, status, OF_CELLS)
    call snapshot%get('volume', self%volume_new, status, OF_CELLS)
    call snapshot%get('state', self%state, status, OF_CELLS)
    call snapshot%get('mean stress', self%mean_stress_old, status, OF_CELLS)
    call snapshot%get('bubble modulus', self%bubble_modulus, status, OF_CELLS)
    call snapshot%get('relaxation', self%relaxation, status, OF_CELLS)
    call snapshot%get('flow stress', self%flow_stress, status, OF_CELLS)
    call snapshot%get('largest force scale', self%largest_force_scale, status)
    call snapshot%get('carried force', self%carried_force, status)
    call snapshot%get('carries', self%carries, status)
    call self%energies%load(snapshot, status)
    call snapshot%get('support force', self%support_force, status, OF_NODES)
    if (size(self%pairs) > 0) then
      call snapshot%get('contact force', self%contact_force, status, OF_NODES)
    end if
    call snapshot%get('tool force', self%tool_force, status)
    call snapshot%get('reaction', self%reaction, status)
    call snapshot%get('load force', self%load_force, status)
    do i = 1, size(self%contacts)
      call self%contacts(i)%load(snapshot, status)
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%load(snapshot, status)
      if (self%pairs(i)%surfaces%is_self) call load_walls(self, self%pairs(i), snapshot, status)
    end do
    do i = 1, size(self%tools)
      call self%tools(i)%load(snapshot, status)
    end do
    call self%comm%agree(status)
    if (status%failed()) return

    call self%reject_step()
    if (.not. snapshot%has(SOLVER_SAVED)) return
    if (size(self%pairs) > 0) call self%matrix%coupling%load(snapshot, status)
    call self%comm%agree(status)
    if (status%failed()) return
    call create_solver(self, status)
    call self%comm%agree(status)
    if (status%failed()) return
    call self%solver%load(snapshot, self%matrix, status)
    call self%comm%agree(status)

  contains

    !> What belongs to the nodes themselves.
    subroutine load_pressure(name, pressure)
      character(len=*), intent(in) :: name
      !> Of the unknown nodes [stress].
      real(wp), intent(inout) :: pressure(:)

      real(wp), allocatable :: nodal(:)

      allocate (nodal(self%mesh%n_node), source=0.0_wp)
      call snapshot%get(name, nodal, status, OF_NODES)
      pressure(self%unknowns%of_node) = nodal

    end subroutine load_pressure

  end procedure mechanics_load

  !> Nodes with further pressures that this rank owns, ascending.
  pure subroutine list_interface(self, node, place)
    class(mechanics_t), intent(in) :: self
    integer, allocatable, intent(out) :: node(:)
    !> Place in that list; shape (n_own_node of the mesh).
    integer, allocatable, intent(out) :: place(:)

    integer :: i, n

    allocate (place(self%mesh%n_own_node), source=0)
    do i = self%mesh%n_own_node + 1, self%unknowns%n_own_node
      place(self%unknowns%mesh_node(i)) = 1
    end do
    allocate (node(sum(place)))
    n = 0
    do i = 1, size(place)
      if (place(i) == 0) cycle
      n = n + 1
      node(n) = i
      place(i) = n
    end do

  end subroutine list_interface

  !> Three rows of further pressures for each material, in columns of nodes: all that a node may
  !> have, so that they go by its number in the mesh.
  subroutine save_further(self, snapshot)
    class(mechanics_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    real(wp), allocatable :: values(:, :)
    integer, allocatable :: node(:), place(:)
    integer :: i, k

    call list_interface(self, node, place)
    allocate (values(3 * size(self%materials), size(node)), source=0.0_wp)
    do i = self%mesh%n_own_node + 1, self%unknowns%n_own_node
      k = 3 * self%unknowns%medium(i)
      values(k - 2:k, place(self%unknowns%mesh_node(i))) = &
        [self%pressure(i), self%pressure_last(i), self%pressure_before(i)]
    end do
    call snapshot%put(FURTHER, values, OF_SOME_NODES, node)

  end subroutine save_further

  !> Collective. Take them back.
  subroutine load_further(self, snapshot, status)
    class(mechanics_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: both(:, :), values(:, :)
    integer, allocatable :: node(:), place(:)
    integer :: i, k

    call list_interface(self, node, place)
    allocate (values(3 * size(self%materials), size(node)), source=0.0_wp)
    call snapshot%get(FURTHER, values, status, OF_SOME_NODES, node)
    allocate (both(3, self%unknowns%n_node))
    both(1, :) = self%pressure
    both(2, :) = self%pressure_last
    both(3, :) = self%pressure_before
    do i = self%mesh%n_own_node + 1, self%unknowns%n_own_node
      k = 3 * self%unknowns%medium(i)
      both(:, i) = values(k - 2:k, place(self%unknowns%mesh_node(i)))
    end do
    call self%unknowns%halo%update(both)
    self%pressure = both(1, :)
    self%pressure_last = both(2, :)
    self%pressure_before = both(3, :)

  end subroutine load_further

  !> How thick walls were, which says what is their own other side.
  subroutine save_walls(self, pair, snapshot)
    class(mechanics_t), intent(in) :: self
    type(body_pair_t), intent(in) :: pair
    type(snapshot_t), intent(inout) :: snapshot

    real(wp), allocatable :: thickness(:)
    integer :: i

    allocate (thickness(self%mesh%n_node), source=0.0_wp)
    do i = 1, self%surface%n_node
      if (self%surface%mesh_node(i) > 0) then
        thickness(self%surface%mesh_node(i)) = pair%surfaces%thickness(i)
      end if
    end do
    call snapshot%put('contact '//pair%contact%name//': thickness', thickness, OF_NODES)

  end subroutine save_walls

  !> Collective.
  subroutine load_walls(self, pair, snapshot, status)
    class(mechanics_t), intent(in) :: self
    type(body_pair_t), intent(inout) :: pair
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: gathered(:, :), thickness(:)

    allocate (thickness(self%mesh%n_node), source=0.0_wp)
    call snapshot%get('contact '//pair%contact%name//': thickness', thickness, status, OF_NODES)
    allocate (gathered(1, self%surface%n_node))
    call self%surface%gather(reshape(thickness, [1, size(thickness)]), gathered)
    pair%surfaces%thickness = gathered(1, :)

  end subroutine load_walls

  !> `axisymmetric, fixed geometry`.
  pure function kind_text(settings) result(string)
    type(mechanics_settings_t), intent(in) :: settings
    character(len=:), allocatable :: string

    select case (settings%kind)
    case (THREE_DIMENSIONAL)
      string = '3d'
    case (AXISYMMETRIC)
      string = 'axisymmetric'
    case default
      string = 'plane strain'
    end select
    if (settings%fixed_geometry) string = string//', fixed geometry'

  end function kind_text

  !> Collective. Counts, and a sum over positions, cells and groups, whatever rank has them.
  function mesh_text(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    character(len=80) :: buffer
    integer(gp) :: sums(3)
    integer :: i, k

    sums = 0_gp
    associate (mesh => self%mesh)
      do i = 1, mesh%n_own_node
        do k = 1, mesh%dimension
          sums(1) = sums(1) + checksum(bytes_of(self%initial_coordinates(k, i)), &
                                       salt=mesh%node_tag(i) + k)
        end do
      end do
      do i = 1, mesh%n_cell
        do k = 1, size(mesh%cell_node, 1)
          sums(2) = sums(2) + checksum(bytes_of(mesh%node_tag(mesh%cell_node(k, i))), &
                                       salt=mesh%cell_tag(i) + k)
        end do
      end do
      call self%comm%sum(sums)
      do i = 1, size(mesh%groups)
        sums(3) = sums(3) + checksum(bytes_of(mesh%groups(i)%n_entity_global), &
                                     salt=int(mesh%groups(i)%tag, gp))
      end do
      write (buffer, '(i0,a,i0,a,3(z8.8))') mesh%n_node_global, ' nodes, ', mesh%n_cell_global, &
        ' cells, sum ', iand(sums, 4294967295_gp)
    end associate
    string = trim(buffer)

  end function mesh_text

  !> `billet of steel, ...`.
  pure function body_names(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    integer :: i

    string = ''
    do i = 1, size(self%bodies)
      if (i > 1) string = string//', '
      string = string//self%bodies(i)%name//' of '//self%materials(self%bodies(i)%material)%name
    end do

  end function body_names

  !> What the laws keep: `steel: equivalent_plastic_strain, ...`.
  pure function history_names(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    integer :: i, j

    string = ''
    do i = 1, size(self%materials)
      if (i > 1) string = string//'; '
      string = string//self%materials(i)%name//':'
      do j = 1, size(self%materials(i)%law%state_table)
        if (j > 1) string = string//','
        string = string//' '//trim(self%materials(i)%law%state_table(j)%name)
      end do
    end do

  end function history_names

  pure function boundary_names(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    integer :: i

    string = ''
    do i = 1, size(self%boundaries)
      if (i > 1) string = string//', '
      string = string//self%boundaries(i)%boundary%name
    end do

  end function boundary_names

  pure function tool_names(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    integer :: i

    string = ''
    do i = 1, size(self%tools)
      if (i > 1) string = string//', '
      string = string//self%tools(i)%name
    end do

  end function tool_names

  pure function contact_names(self) result(string)
    class(mechanics_t), intent(in) :: self
    character(len=:), allocatable :: string

    integer :: i

    string = ''
    do i = 1, size(self%contacts)
      if (i > 1) string = string//', '
      string = string//self%contacts(i)%name
    end do
    do i = 1, size(self%pairs)
      if (string /= '') string = string//', '
      string = string//self%pairs(i)%contact%name
    end do

  end function contact_names

end submodule swage_mechanics_restart
