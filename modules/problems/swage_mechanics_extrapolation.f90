!> Where [[swage_mechanics]] uses a law beyond what was measured.
submodule(swage_mechanics) swage_mechanics_extrapolation
  use swage_material_law, only: ROW_RATE, ROW_STRAIN
  use swage_number, only: number_text
  implicit none(type, external)

contains

  module procedure mechanics_find_extrapolation

    integer :: i

    warning = ''
    do i = 1, size(self%materials)
      associate (material => self%materials(i))
        call compare(self, i, ROW_STRAIN, 'strain', material%law%largest_strain, &
                     material%told_strain, warning)
        call compare(self, i, ROW_RATE, 'strain rate', material%law%largest_rate, &
                     material%told_rate, warning)
      end associate
    end do

  end procedure mechanics_find_extrapolation

  !> Collective. Warn when the largest value of a history variable is beyond what a law knows.
  subroutine compare(self, material, row, what, known, told, warning)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: material
    integer, intent(in) :: row
    character(len=*), intent(in) :: what
    real(wp), intent(in) :: known
    logical, intent(inout) :: told
    character(len=:), allocatable, intent(inout) :: warning

    real(wp) :: largest
    integer :: cell

    ! The same on all ranks
    if (told .or. known >= huge(known) .or. warning /= '') return
    largest = 0.0_wp
    do cell = 1, self%mesh%n_cell
      if (self%material_of_cell(cell) == material) largest = max(largest, self%state(row, cell))
    end do
    call self%comm%max(largest)
    if (largest <= known) return
    told = .true.
    warning = 'material '//self%materials(material)%name//': the plastic '//what// &
      ' reaches '//number_text(largest)//', its flow stress is known up to '// &
      number_text(known)//' and stays constant beyond'

  end subroutine compare

end submodule swage_mechanics_extrapolation
