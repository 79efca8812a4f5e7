! The planar elastica for AUTO-07p: place (X, Y), angle and couple along the rod; the end, free to turn, is held at (X, Y) = (PAR(4), PAR(1)).
! PAR(2), PAR(3) are the force along X and Y.
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: c, s
  c = cos(u(3))
  s = sin(u(3))
  f = (/ c, s, u(4), s*par(2) - c*par(3) /)
  if (ijac == 0) return
  dfdu(:, 1:2) = 0
  dfdu(:, 3) = (/ -s, c, 0d0, c*par(2) + s*par(3) /)
  dfdu(:, 4) = (/ 0d0, 0d0, 1d0, 0d0 /)
  if (ijac == 1) return
  dfdp(:, 1:4) = 0
  dfdp(4, 2) = s
  dfdp(4, 3) = -c
end subroutine func

! The start: an equilibrium with the end at Y = 0.3, by Runge-Kutta steps from its base couple and force.
subroutine stpnt(ndim, u, par, t)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  integer, parameter :: steps = 400
  double precision :: k(4, 4), h, none(1)
  integer :: i
  par(1:4) = (/ 0.3d0, -13.958892104793499d0, -13.86744286252284d0, 0.57369935533303649d0 /)
  u = (/ 0d0, 0d0, 0d0, -3.768075398909023d0 /)
  h = t/steps
  do i = 1, steps
     call func(4, u, (/0/), par, 0, k(:, 1), none, none)
     call func(4, u + h/2*k(:, 1), (/0/), par, 0, k(:, 2), none, none)
     call func(4, u + h/2*k(:, 2), (/0/), par, 0, k(:, 3), none, none)
     call func(4, u + h*k(:, 3), (/0/), par, 0, k(:, 4), none, none)
     u = u + h/6*(k(:, 1) + 2*k(:, 2) + 2*k(:, 3) + k(:, 4))
  end do
end subroutine stpnt

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  fb = (/ u0(1), u0(2), u0(3), u1(4), u1(1) - par(4), u1(2) - par(1) /)
  if (ijac == 0) return
  dbc(:, 1:2*ndim + 4) = 0
  dbc(1, 1) = 1
  dbc(2, 2) = 1
  dbc(3, 3) = 1
  dbc(4, 8) = 1
  dbc(5, 5) = 1
  dbc(6, 6) = 1
  if (ijac == 1) return
  dbc(5, 12) = -1
  dbc(6, 9) = -1
end subroutine bcnd

subroutine icnd
end subroutine icnd

subroutine fopt
end subroutine fopt

subroutine pvls
end subroutine pvls
