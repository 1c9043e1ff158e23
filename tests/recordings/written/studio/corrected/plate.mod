MODULE Plate
  ! corrected by truearm 0.1.0
  ! 2026-11-28, calibration 3c3a9b5f
  ! for irb120
  ! SIMULATED: no real calibration
  ! Touches twelve holes of a plate and goes round a circle on it.
  ! Written off-line: the poses are those of the drawing.
  PERS tooldata tProbe:=[TRUE,[[0,0,125],[1,0,0,0]],[2.7,[50,25,100],[1,0,0,0],0,0,0]];
  PERS wobjdata wobjPlate:=[FALSE,TRUE,"",[[310,-110,60],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];

  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pStart:=[[-9.117,99.969,60.991],[-0.0670746,-0.0085006,0.9903118,0.1212904],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole1:=[[20.955,19.749,1.131],[-0.0671488,-0.0085064,0.9903623,0.1208355],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole2:=[[90.955,19.826,1.453],[-0.0669190,-0.0085373,0.9903611,0.1209701],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole3:=[[160.890,19.900,1.809],[-0.0667009,-0.0085915,0.9903587,0.1211066],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole4:=[[20.988,79.894,1.077],[-0.0671002,-0.0084842,0.9903232,0.1211843],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole5:=[[90.987,79.954,1.404],[-0.0668811,-0.0085082,0.9903232,0.1213034],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole6:=[[160.929,80.010,1.765],[-0.0666711,-0.0085571,0.9903212,0.1214315],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole7:=[[21.003,140.054,1.073],[-0.0670729,-0.0084632,0.9902797,0.1215551],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole8:=[[91.000,140.094,1.401],[-0.0668609,-0.0084807,0.9902819,0.1216527],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole9:=[[160.943,140.129,1.764],[-0.0666580,-0.0085267,0.9902809,0.1217694],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole10:=[[20.998,200.222,1.120],[-0.0670706,-0.0084398,0.9902328,0.1219398],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole11:=[[90.994,200.239,1.446],[-0.0668603,-0.0084534,0.9902377,0.1220145],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole12:=[[160.935,200.253,1.807],[-0.0666628,-0.0085000,0.9902377,0.1221193],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcIn:=[[40.991,109.991,6.161],[-0.0670140,-0.0084802,0.9903026,0.1214002],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia1:=[[90.965,59.915,6.417],[-0.0668870,-0.0085210,0.9903363,0.1211920],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcOut:=[[140.948,110.059,6.653],[-0.0667166,-0.0085276,0.9903021,0.1215648],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia2:=[[90.988,160.144,6.413],[-0.0668528,-0.0084743,0.9902673,0.1217764],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC main()
    MoveAbsJ jHome,v500,z50,tProbe\WObj:=wobjPlate;
    MoveJ pStart,v500,z20,tProbe\WObj:=wobjPlate;
    TouchHoles;
    RoundTheCircle;
    MoveAbsJ jHome,v500,fine,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC TouchHoles()
    MoveL Offs(pHole1,-0.030,0.016,15.007),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole1,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole1,-0.030,0.016,15.007),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,-0.039,0.017,15.002),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole2,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,-0.039,0.017,15.002),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,-0.048,0.017,14.997),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole3,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,-0.048,0.017,14.997),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,-0.028,0.012,15.009),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole4,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,-0.028,0.012,15.009),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,-0.038,0.012,15.004),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole5,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,-0.038,0.012,15.004),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,-0.048,0.012,14.998),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole6,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,-0.048,0.012,14.998),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,-0.027,0.009,15.010),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole7,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,-0.027,0.009,15.010),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,-0.038,0.008,15.005),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole8,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,-0.038,0.008,15.005),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,-0.048,0.007,14.999),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole9,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,-0.048,0.007,14.999),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,-0.027,0.005,15.011),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole10,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,-0.027,0.005,15.011),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,-0.038,0.003,15.006),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole11,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,-0.038,0.003,15.006),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,-0.048,0.002,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole12,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,-0.048,0.002,15),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC RoundTheCircle()
    MoveL Offs(pArcIn,-0.031,0.011,15.008),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveC pArcVia1,pArcOut,v50,z1,tProbe\WObj:=wobjPlate;
    MoveC pArcVia2,pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pArcIn,-0.031,0.011,15.008),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC
ENDMODULE
