/PROG  SEAM
/ATTR
OWNER		= MNEDITOR;
LINE_COUNT	= 26;
DEFAULT_GROUP	= 1,1,*,*,*;
/APPL
  ARC : TRUE ; 

LINE_TRACK;
  LINE_TRACK_SCHEDULE_NUMBER      : 0;

/MN
   1:  !Naht auf dem Kipptisch, äöü ;
   2:  UTOOL_NUM[GP1]=1 ;
   3:  UTOOL_NUM[GP2]=4 ;
   4:  IF DI[2]=ON THEN ;
   5:  UFRAME_NUM=1 ;
   6:  ELSE ;
   7:  UFRAME_NUM=3 ;
   8:L P[1] 30cm/min FINE    ;
   9:  ENDIF ;
  10:L P[2] 30cm/min FINE    ;
  11:J P[3] 40% CNT30    ;
      1:  TC_ONLINE (DI[76] AND M[3]) ;
      2:  DO[23]=(OFF) ;
      3:  !L P[50] ;
       ------ ;
  12:L P[4] WELD_SPEED CNT100
    :  Arc Start[6]    ;
  13:  Weave Sine[5] ;
  14:C P[5] Tool_Offset,PR[28]
    :  P[6] WELD_SPEED CNT100 Tool_Offset,PR[29]    ;
  15:C P[7] 
       P[8] WELD_SPEED FINE ;
  16:L P[9] WELD_SPEED FINE COORD    ;
  17:L P[10:gun] 2000mm/sec FINE RTCP
    :  SPOT[SD=3,P=1,S=1,ED=3]    ;
  18:S P[11] 100mm/sec CNT100    ;
  19:S P[3] 100mm/sec FINE    ;
  20:J P[12] 100% FINE Skip,LBL[9]    ;
  21:C PR[4] 
    :  P[8] 40cm/min FINE    ;
  22:C P[8] 40cm/min FINE    ;
  23:  LBL[9:done] ;
  24:  $SPEED=12.5 ;
  25:  WELD HOME    ;
  26:  END ;
/POS
P[1]{
   GP1:
	UF : F, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1200.000  mm,	Y =   100.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
   GP2:
	UF : 0, UT : 4,	
	J1=    20.000 deg,	J2=   180.000 deg
};
P[2]{
   GP1:
	UF : F, UT : F,		CONFIG : 'N U T, 0, 0, 0',
	X =  1250.000  mm,	Y =   100.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
   GP2:
	UF : 0, UT : 4,	
	J1=    20.000 deg,	J2=   180.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1300.000  mm,	Y =   100.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
   GP2:
	UF : 0, UT : 4,	
	J1=    20.000 deg,	J2=   180.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1350.000  mm,	Y =   100.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1360.000  mm,	Y =   110.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1360.000  mm,	Y =   120.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[7]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1350.000  mm,	Y =   130.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[8]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1340.000  mm,	Y =   120.000  mm,	Z =   600.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[9]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     5.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =     0.000 deg,	P =     0.000 deg,	R =     0.000 deg
   GP2:
	UF : 0, UT : 4,	
	J1=    20.000 deg,	J2=   170.000 deg
};
P[10:"gun"]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     5.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =     0.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[11]{
   GP1:
	UF : 1, UT : 1,
	J1=     0.000 deg,	J2=   -20.000 deg,	J3=    15.500 deg,
	J4=      .000 deg,	J5=   -75.500 deg,	J6=      .000 deg,
	E1=  -500.000  mm
};
P[12]{
   GP2:
	UF : 0, UT : 4,	
	J1=    20.000 deg,	J2=   180.000 deg
};
P[20:"unused"]{
   GP1:
	UF : 1, UT : F,		CONFIG : 'N U T, 0, 0, 0',
	X =  1300.000  mm,	Y =     0.000  mm,	Z =   900.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
P[21]{
   GP1:
	UF : F, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1300.000  mm,	Y =     0.000  mm,	Z =   900.000  mm,
	W =    90.000 deg,	P =    45.000 deg,	R =   -90.000 deg
};
/END
