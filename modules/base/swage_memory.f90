!> Memory used by the running process.
module swage_memory
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: peak_memory

contains

  !> Largest memory this process has held so far, in megabytes of 2^20 bytes; 0 where the system
  !> does not tell (it is read from `/proc/self/status`, which only Linux has).
  function peak_memory() result(megabytes)
    real(wp) :: megabytes

    character(len=*), parameter :: KEY = 'VmHWM:'
    character(len=256) :: line
    integer :: code, kilobytes, unit

    megabytes = 0.0_wp
    open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=code)
    if (code /= 0) return
    do
      read (unit, '(a)', iostat=code) line
      if (code /= 0) exit
      if (index(line, KEY) /= 1) cycle
      read (line(len(KEY) + 1:), *, iostat=code) kilobytes
      if (code == 0) megabytes = real(kilobytes, wp) / 1024.0_wp
      exit
    end do
    close (unit)

  end function peak_memory

end module swage_memory
