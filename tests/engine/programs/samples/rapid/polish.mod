%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE Polish(NOSTEPIN)
  ! Polishing of a cover. MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v10,fine,tool0; is no move here
  ! An open bracket [[ and an open string " in a comment, and "MODULE Other" too

  PERS tooldata tDisc:=[TRUE,[[-12.5,0.25,118.75],[0.9659258,0,0.2588190,0]],[0.8,[0,0,45],[1,0,0,0],0,0,0]];
  TASK PERS tooldata tStand:=[FALSE,[[420,0,310],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata wCover := [ FALSE, TRUE, "", [[350, -60, 80.5], [0.7071068, 0, 0, 0.7071068]],
                                             [[10, 20, 0], [1, 0, 0, 0]] ];
  PERS wobjdata wTable:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wPart:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST speeddata vSlow:=[35,120,5000,1000];
  CONST string sHint:="say ""MoveL p10;"" or [not]";

  CONST jointtarget jHome:=[[0,-20.5,25,0,60,-1.5E+01],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST jointtarget jTrack:=[[9E9,9E9,9E9,9E9,9E9,9E9],[250,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p10:=[[60.125,-14.0,12],[0,0.7071068,0.7071068,0],[0,-1,-2,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  LOCAL CONST robtarget p20 := [ [61.5, 4.75, 12.000]
      , [0.0087265, 0.7071068, 0.7070529, 0]   ! near p10
      , [-1, 0, 1, 4]
      , [000.0, 9E9, 9E9, 9E9, 9E9, 9E9] ];
  CONST robtarget pRow{3}:=[[[0,0,5],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
                            [[0,10,5],[0,1,0,0],[0,0,0,2],[9E9,9E9,9E9,9E9,9E9,9E9]],   ! the middle
                            [[0,20,5],[0,1,0,0],[0,0,0,3],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST robtarget pGrid{2,2}:=[[[[0,0,40],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
                                [[5,0,40],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],
                               [[[0,5,40],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
                                [[5,5,40],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  VAR robtarget pFound;
  VAR robtarget pShift:=[[1,1,1],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pMixed:=[[nX,1,1],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pBoth:=[[7,7,7],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pStand:=[[8,8,8],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTurned:=[[9,9,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSpare:=[[3,3,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nX:=3;

  PROC main()
    ConfL \Off;
    MoveAbsJ jHome\NoEOffs,v500,z50,tDisc;
    MoveJ \Conc, p10, v500\T:=2, z10\Inpos:=inpos20, TDISC\WObj:=wCover\TLoad:=load0;
    MoveL p20,v100,fine,tDisc\WObj:=WCOVER;
    MoveC [[62,10,12],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
          p10, vSlow, z1, tDisc \WObj:=wCover;
    edge;
    MoveL Offs(p10,0,0,-2.5),v100,z5,tDisc\WObj:=wCover;
    MoveL RelTool (p20, 0, 0.5, -30 \Rz:=12.5), v100, z5, tDisc \WObj:=wCover;
    MoveL RelTool(Offs(p10,1,2,3),4,5,6\Rx:=1\Ry:=-2),v100,z5,tDisc\WObj:=wCover;
    MoveL Offs(p10,0,nX,0),v100,z5,tDisc\WObj:=wCover;
    MoveL [[300,0,400],[0,0,1,0],[0,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\ID:=20,v100,fine,tool0;
    IF nX>2 MoveL p10,v100,fine,tDisc\WObj:=wCover;
    FOR i FROM 1 TO 3 DO
      MoveL pRow{i},v100,z1,tDisc\WObj:=wCover;
    ENDFOR
    MoveL pGrid{2,1},v100,z1,tDisc\WObj:=wCover;
    TEST nX
    CASE 1,2:
      MoveLDO p20,v100,z1,tDisc\WObj:=wCover,doBlow,1;
    DEFAULT:
      TriggL p20,v100,trStart\T2:=trStop,z1,tDisc\WObj:=wCover;
    ENDTEST
    MoveL pMixed,v100,z1,tDisc\WObj:=wCover;
    MoveL pBoth,v100,z1,tDisc\WObj:=wCover;
    MoveL pBoth,v100,z1,tool0;
    MoveL pStand,v100,z1,tStand\WObj:=wPart;
    MoveL pTurned,v100,z1,tDisc\WObj:=wTable;
    MoveL pElsewhere,v100,z1,tDisc\WObj:=wCover;
    MoveL CRobT(\Tool:=tDisc),v100,z1,tDisc\WObj:=wCover;
    MoveAbsJ [[10,0,0,0,30,-720.25],[9E9,9E9,9E9,9E9,9E9,9E9]]\NoEOffs,v500,fine,tDisc;
    MoveExtJ jTrack,vrot10,fine;
    GlueOn 3, sHint;
    glueon 4;
    TPWrite "done; MoveL [[[";
    nX:=nX+1;
    RETURN;
  ERROR
    MoveJ p10,v50,fine,tDisc\WObj:=wCover;
    RETRY;
  ENDPROC

  LOCAL PROC edge()
    CONST robtarget p10:=[[1.5,2.5,3.5],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]; ! not the module's
    SearchL \Stop, diTouch, pFound, p10, v50, tDisc\WObj:=wCover;
    MoveL pFound,v50,fine,tDisc\WObj:=wCover;
    pShift.trans.z:=3;
    MoveL pShift,v50,fine,tDisc\WObj:=wCover;
  ENDPROC

  PROC goTo(robtarget pGiven, PERS tooldata tGiven \PERS wobjdata WObj)
    MoveL pGiven,v50,fine,tGiven\WObj?WObj;
  ENDPROC
ENDMODULE
