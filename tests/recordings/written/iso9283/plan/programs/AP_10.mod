MODULE AP_10
  ! ISO 9283 AP
  ! Robot irb120
  ! 10 % velocity, load 3 kg
  ! Plan 7085afe1e6b0
  ! Not verified, no safety function
  ! First run: step by step,
  ! at reduced speed, nobody near
  CONST jointtarget j1:=[[0.0000,10.9597,17.6344,0.0000,61.4059,-180.0000],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget j2:=[[-10.5392,34.2659,1.7857,0.0000,53.9484,-190.5392],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget j3:=[[-16.5044,4.3674,41.3251,0.0000,44.3075,-196.5044],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget j4:=[[16.5044,-6.0241,20.2772,0.0000,75.7469,-163.4956],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget j5:=[[10.5392,28.3805,-19.8543,0.0000,81.4738,-169.4608],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST speeddata s1:=[100,500,5000,1000];

  PROC AP_10_main()
    ConfL \Off;
    CirPathMode \ObjectFrame;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    ! cycle 1 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 2 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 3 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 4 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 5 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 6 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 7 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 8 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 9 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 10 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 11 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 12 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 13 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 14 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 15 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 16 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 17 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 18 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 19 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 20 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 21 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 22 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 23 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 24 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 25 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 26 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 27 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 28 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 29 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! cycle 30 of 30
    ! To P5
    MoveAbsJ j2,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P4
    MoveAbsJ j3,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P3
    MoveAbsJ j4,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P2
    MoveAbsJ j5,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    WaitTime \InPos,2;
    ! To P1
    MoveAbsJ j1,s1,fine,tool0;
    CirPathMode \PathFrame;
    ConfL \On;
  ENDPROC
ENDMODULE
