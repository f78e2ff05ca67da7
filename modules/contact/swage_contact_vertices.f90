!> Vertices that touch with none of their facets, or not with these alone.
!>
!> The pressure of such a node of the slave acts by its share \(w\) at the node itself, along the
!> normal of the master at its foot, and by the rest over its facets, along their normals:
!> \(A g = w A_v p + \sum_f w_f \int N\, p\, dS\) and forces alike, with
!> \(w = 1 - \max_f w_f\). The shares are those of the start of the step
!> ([[contact_surface_t:face_share]]): nothing is left of a vertex where one of its facets lies on
!> the master, so that level faces keep their uniform pressure. A vertex of the master has a
!> condition of its own, of the area \(w A_v\), beside those of the slave.
!> Source, for conditions of vertices beside those of faces: P. Farah, W. A. Wall, A. Popp, A mortar
!> finite element approach for point, line, and surface contact, Int. J. Numer. Meth. Engng. 114
!> (2018).
module swage_contact_vertices
  use swage_contact_conditions, only: condition_list_t, node_conditions
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_surface, only: contact_surface_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: contact_vertices_t

  type :: contact_vertices_t
    private
    type(condition_list_t) :: slave, master
    !> Place in the slave's list of each node, 0 for none.
    integer, allocatable :: place(:)
  contains
    !> Find those that count.
    procedure :: find => contact_vertices_find
    !> Add what the vertex at a node gives to area, area times gap and area times normal.
    procedure :: weigh => contact_vertices_weigh
    !> Add its forces to the present row.
    procedure :: add_forces => contact_vertices_add_forces
    !> Make rows of those of the master.
    procedure :: put => contact_vertices_put
    !> Add the derivatives of the forces of all.
    procedure :: stiffen => contact_vertices_stiffen
  end type contact_vertices_t

contains

  subroutine contact_vertices_find(self, pair, mine)
    class(contact_vertices_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    !> Nodes of this rank; shape (n_node).
    logical, intent(in) :: mine(:)

    integer :: i
    logical :: theirs(pair%n_node)

    if (allocated(self%place)) then
      if (size(self%place) /= pair%n_node) deallocate (self%place)
    end if
    if (.not. allocated(self%place)) allocate (self%place(pair%n_node))
    call find_on(pair%slave, pair%master, mine, self%slave)
    self%place = 0
    do i = 1, self%slave%n
      self%place(self%slave%item(i)%slave) = i
    end do
    ! A node of both has the condition of the slave
    theirs = mine
    theirs(pair%slave%node) = .false.
    call find_on(pair%master, pair%slave, theirs, self%master)

  contains

    subroutine find_on(surface, other, counts, list)
      type(contact_surface_t), intent(in) :: surface
      type(contact_surface_t), intent(in) :: other
      !> Shape (n_node).
      logical, intent(in) :: counts(:)
      type(condition_list_t), intent(inout) :: list

      integer :: k

      list%n = 0
      call node_conditions(pair, surface, other, counts .and. surface%vertex_share > 0.0_wp, list)
      do k = 1, list%n
        list%item(k)%area = surface%vertex_share(list%item(k)%slave) * list%item(k)%area
      end do

    end subroutine find_on

  end subroutine contact_vertices_find

  pure subroutine contact_vertices_weigh(self, node, area, gap, normal)
    class(contact_vertices_t), intent(in) :: self
    integer, intent(in) :: node
    !> [length^2], [length^3], [length^2]; added to.
    real(wp), intent(inout) :: area
    real(wp), intent(inout) :: gap
    real(wp), intent(inout) :: normal(3)

    if (self%place(node) == 0) return
    associate (item => self%slave%item(self%place(node)))
      area = area + item%area
      gap = gap + item%area * item%foot%penetration
      normal = normal - item%area * item%foot%normal
    end associate

  end subroutine contact_vertices_weigh

  subroutine contact_vertices_add_forces(self, node, has_slope, rows)
    class(contact_vertices_t), intent(in) :: self
    integer, intent(in) :: node
    !> Add to the slope, too.
    logical, intent(in) :: has_slope
    type(contact_rows_t), intent(inout) :: rows

    if (self%place(node) == 0) return
    associate (item => self%slave%item(self%place(node)))
      call item%add_forces(item%area, .true., has_slope, rows)
    end associate

  end subroutine contact_vertices_add_forces

  subroutine contact_vertices_put(self, rows)
    class(contact_vertices_t), intent(in) :: self
    type(contact_rows_t), intent(inout) :: rows

    integer :: i

    do i = 1, self%master%n
      call self%master%item(i)%put(1.0_wp, .true., rows)
    end do

  end subroutine contact_vertices_put

  subroutine contact_vertices_stiffen(self, pressure, blocks)
    class(contact_vertices_t), intent(in) :: self
    !> Of the conditions of nodes, their own or those of their facets [stress]; shape (n_node).
    real(wp), intent(in) :: pressure(:)
    type(contact_blocks_t), intent(inout) :: blocks

    call stiffen_list(self%slave)
    call stiffen_list(self%master)

  contains

    subroutine stiffen_list(list)
      type(condition_list_t), intent(in) :: list

      integer :: i
      real(wp) :: load

      do i = 1, list%n
        load = list%item(i)%area * pressure(list%item(i)%slave)
        if (abs(load) > 0.0_wp) call list%item(i)%stiffen(load, .true., blocks)
      end do

    end subroutine stiffen_list

  end subroutine contact_vertices_stiffen

end module swage_contact_vertices
