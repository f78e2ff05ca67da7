!> A program that drives Swage: pull a bar, print the time and the largest displacement.
program pull
  use swage, only: comm_t, environment_start, environment_stop, simulation_t, status_t, wp
  implicit none(type, external)
  type(comm_t) :: comm
  type(simulation_t) :: simulation
  type(status_t) :: status
  real(wp), allocatable :: displacement(:, :)

  call environment_start(comm)
  call simulation%start('bar.nml', comm, status)
  if (.not. status%failed()) call simulation%run(status)
  if (.not. status%failed()) call simulation%get_field('displacement', displacement, status)
  if (status%failed()) error stop trim(status%message)
  print '(a,f0.4,a,f0.6)', 'time ', simulation%get_time(), ' displacement ', maxval(displacement)
  call simulation%finish(status)
  call environment_stop()
end program pull
