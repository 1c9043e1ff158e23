MODULE Plate
  ! Touches twelve holes of a plate and goes round a circle on it.
  ! Written off-line: the poses are those of the drawing.
  PERS tooldata tProbe:=[TRUE,[[0,0,125],[1,0,0,0]],[2.7,[50,25,100],[1,0,0,0],0,0,0]];
  PERS wobjdata wobjPlate:=[FALSE,TRUE,"",[[310,-110,60],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];

  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pStart:=[[-10.0,100.0,60.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole1:=[[20.0,20.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole2:=[[90.0,20.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole3:=[[160.0,20.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole4:=[[20.0,80.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole5:=[[90.0,80.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole6:=[[160.0,80.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole7:=[[20.0,140.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole8:=[[90.0,140.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole9:=[[160.0,140.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole10:=[[20.0,200.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole11:=[[90.0,200.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHole12:=[[160.0,200.0,0.0],[-0.069237,-0.008501,0.990128,0.121572],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcIn:=[[40.0,110.0,5.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia1:=[[90.0,60.0,5.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcOut:=[[140.0,110.0,5.0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pArcVia2:=[[90.0,160.0,5.0],[-0.069237,-0.008501,0.990128,0.121572],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC main()
    MoveAbsJ jHome,v500,z50,tProbe\WObj:=wobjPlate;
    MoveJ pStart,v500,z20,tProbe\WObj:=wobjPlate;
    TouchHoles;
    RoundTheCircle;
    MoveAbsJ jHome,v500,fine,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC TouchHoles()
    MoveL Offs(pHole1,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole1,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole1,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole2,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole2,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole3,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole3,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole4,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole4,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole5,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole5,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole6,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole6,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole7,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole7,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole8,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole8,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole9,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole9,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole10,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole10,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole11,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole11,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pHole12,v20,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pHole12,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC

  PROC RoundTheCircle()
    MoveL Offs(pArcIn,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
    MoveL pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveC pArcVia1,pArcOut,v50,z1,tProbe\WObj:=wobjPlate;
    MoveC pArcVia2,pArcIn,v50,fine,tProbe\WObj:=wobjPlate;
    MoveL Offs(pArcIn,0,0,15),v200,z5,tProbe\WObj:=wobjPlate;
  ENDPROC
ENDMODULE
