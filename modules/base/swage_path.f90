!> What stands at a path, for messages about files that cannot be opened.
module swage_path
  implicit none(type, external)
  private

  public :: describe_unreadable, is_folder

contains

  !> True when a folder stands there.
  function is_folder(path)
    character(len=*), intent(in) :: path
    logical :: is_folder

    inquire (file=trim(path)//'/.', exist=is_folder)

  end function is_folder

  !> Why a file could not be opened or read, in words; for a message, after the attempt failed.
  function describe_unreadable(path, reason) result(words)
    character(len=*), intent(in) :: path
    !> What the run-time library said.
    character(len=*), intent(in) :: reason
    character(len=:), allocatable :: words

    logical :: is_there

    inquire (file=trim(path), exist=is_there)
    if (.not. is_there) then
      words = 'there is no such file'
    else if (is_folder(path)) then
      words = 'it is a folder, a file is expected'
    else
      words = trim(reason)
    end if

  end function describe_unreadable

end module swage_path
