!> Checksums: whether bytes are still what they were.
module swage_checksum
  use, intrinsic :: iso_fortran_env, only: int32, int8
  use swage_kinds, only: gp, wp
  implicit none(type, external)
  private

  public :: checksum, checksum_text, bytes_of

  !> The polynomial of CRC-32 (IEEE 802.3), bits reversed: 0xEDB88320.
  integer(int32), parameter :: POLYNOMIAL = -306674912_int32

  ! The remainder of each byte, one bit after the other
  integer :: k
  integer(int32), parameter :: BIT_0(0:255) = [(int(k, int32), k=0, 255)]
  integer(int32), parameter :: BIT_1(0:255) = &
    ieor(ishft(BIT_0, -1), POLYNOMIAL * iand(BIT_0, 1_int32))
  integer(int32), parameter :: BIT_2(0:255) = &
    ieor(ishft(BIT_1, -1), POLYNOMIAL * iand(BIT_1, 1_int32))
  integer(int32), parameter :: BIT_3(0:255) = &
    ieor(ishft(BIT_2, -1), POLYNOMIAL * iand(BIT_2, 1_int32))
  integer(int32), parameter :: BIT_4(0:255) = &
    ieor(ishft(BIT_3, -1), POLYNOMIAL * iand(BIT_3, 1_int32))
  integer(int32), parameter :: BIT_5(0:255) = &
    ieor(ishft(BIT_4, -1), POLYNOMIAL * iand(BIT_4, 1_int32))
  integer(int32), parameter :: BIT_6(0:255) = &
    ieor(ishft(BIT_5, -1), POLYNOMIAL * iand(BIT_5, 1_int32))
  integer(int32), parameter :: BIT_7(0:255) = &
    ieor(ishft(BIT_6, -1), POLYNOMIAL * iand(BIT_6, 1_int32))
  integer(int32), parameter :: REMAINDER(0:255) = &
    ieor(ishft(BIT_7, -1), POLYNOMIAL * iand(BIT_7, 1_int32))

  !> The bytes of a number.
  interface bytes_of
    module procedure bytes_of_real, bytes_of_long
  end interface bytes_of

contains

  !> CRC-32 of some bytes, from 0 to 2^32 - 1.
  pure function checksum(bytes, salt) result(value)
    integer(int8), contiguous, intent(in) :: bytes(:)
    !> Makes equal bytes differ, as their place in a file does; 0 when absent: the usual CRC-32.
    integer(gp), intent(in), optional :: salt
    integer(gp) :: value

    integer(int32) :: register
    integer :: i

    register = -1_int32
    if (present(salt)) register = ieor(register, int(iand(salt, 2147483647_gp), int32))
    do i = 1, size(bytes)
      register = ieor(ishft(register, -8), &
                      REMAINDER(iand(ieor(register, int(bytes(i), int32)), 255_int32)))
    end do
    value = iand(int(not(register), gp), 4294967295_gp)

  end function checksum

  !> CRC-32 of a text.
  pure function checksum_text(string) result(value)
    character(len=*), intent(in) :: string
    integer(gp) :: value

    value = checksum(transfer(string, [0_int8]))

  end function checksum_text

  pure function bytes_of_real(number) result(bytes)
    real(wp), intent(in) :: number
    integer(int8) :: bytes(8)

    bytes = transfer(number, bytes)

  end function bytes_of_real

  pure function bytes_of_long(number) result(bytes)
    integer(gp), intent(in) :: number
    integer(int8) :: bytes(8)

    bytes = transfer(number, bytes)

  end function bytes_of_long

end module swage_checksum
