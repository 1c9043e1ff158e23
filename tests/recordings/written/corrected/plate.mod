MODULE Plate
  ! corrected by truearm 0.1.0
  ! 2026-11-28, calibration 7720a436
  ! for irb120
  ! SIMULATED: no real calibration
  ! Touches twelve holes of a plate and goes round a circle on it.
  ! Written off-line: the poses are those of the drawing.
  PERS tooldata tProbe:=[TRUE,[[0,0,125],[1,0,0,0]],[2.7,[50,25,100],[1,0,0,0],0,0,0]];
  PERS wobjdata wobjPlate:=[FALSE,TRUE,"",[[310,-110,60],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];

  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pStart:=[[-8.403,100.100,60.995],[-0.0669563,-0.0085538,0.9903075,0.1213864],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole1:=[[21.684,19.886,1.133],[-0.0670383,-0.0085585,0.9903600,0.1209122],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole2:=[[91.679,19.966,1.473],[-0.0668138,-0.0085847,0.9903588,0.1210437],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole3:=[[161.613,20.043,1.849],[-0.0666017,-0.0086366,0.9903565,0.1211760],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole4:=[[21.710,80.033,1.088],[-0.0669863,-0.0085369,0.9903207,0.1212638],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole5:=[[91.705,80.095,1.433],[-0.0667727,-0.0085560,0.9903207,0.1213797],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole6:=[[161.645,80.153,1.814],[-0.0665685,-0.0086021,0.9903189,0.1215034],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole7:=[[21.716,140.194,1.093],[-0.0669570,-0.0085161,0.9902770,0.1216375],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole8:=[[91.712,140.234,1.441],[-0.0667502,-0.0085286,0.9902793,0.1217315],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole9:=[[161.653,140.273,1.823],[-0.0665530,-0.0085717,0.9902784,0.1218435],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole10:=[[21.703,200.362,1.151],[-0.0669539,-0.0084922,0.9902298,0.1220248],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole11:=[[91.698,200.379,1.495],[-0.0667486,-0.0085011,0.9902349,0.1220954],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole12:=[[161.638,200.396,1.876],[-0.0665566,-0.0085451,0.9902351,0.1221951],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcIn:=[[41.708,110.130,6.182],[-0.0669004,-0.0085312,0.9902999,0.1214815],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia1:=[[91.685,60.054,6.442],[-0.0667794,-0.0085685,0.9903338,0.1212684],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcOut:=[[141.661,110.201,6.700],[-0.0666109,-0.0085728,0.9902995,0.1216401],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia2:=[[91.696,160.284,6.455],[-0.0667417,-0.0085218,0.9902645,0.1218570],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC main()
    MoveAbsJ jHome,v500,z50,tProbe\WObj:=wobjPlate;
    MoveJ pStart,v500,z20,tProbe\WObj:=wobjPlate;
    TouchHoles;
    RoundTheCircle;
    MoveAbsJ jHome,v500,fine,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC TouchHoles()
    MoveL Offs(pHole1,-0.031,0.014,15.006),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole1,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole1,-0.031,0.014,15.006),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,-0.042,0.015,15.002),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole2,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,-0.042,0.015,15.002),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,-0.050,0.015,14.996),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole3,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,-0.050,0.015,14.996),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,-0.030,0.010,15.008),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole4,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,-0.030,0.010,15.008),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,-0.041,0.010,15.003),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole5,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,-0.041,0.010,15.003),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,-0.050,0.010,14.998),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole6,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,-0.050,0.010,14.998),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,-0.029,0.007,15.009),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole7,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,-0.029,0.007,15.009),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,-0.040,0.006,15.004),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole8,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,-0.040,0.006,15.004),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,-0.050,0.005,14.999),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole9,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,-0.050,0.005,14.999),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,-0.029,0.003,15.010),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole10,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,-0.029,0.003,15.010),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,-0.041,0.002,15.005),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole11,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,-0.041,0.002,15.005),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,-0.051,0,14.999),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole12,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,-0.051,0,14.999),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC RoundTheCircle()
    MoveL Offs(pArcIn,-0.033,0.009,15.008),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveC pArcVia1,pArcOut,v50,z1,tProbe\WObj:=wobjPlate;
    MoveC pArcVia2,pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pArcIn,-0.033,0.009,15.008),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC
ENDMODULE
