/PROG  BRACKET	  Process
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "P[1]{ no code";
PROG_SIZE	= 2412;
CREATE		= DATE 24-03-11  TIME 08:12:40;
MODIFIED	= DATE 24-05-02  TIME 16:47:08;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 34;
MEMORY_SIZE	= 2876;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/APPL
/MN
   1:  !Deburr a bracket; L P[99] is no move ;
   2:  --eg:edges A and B, taught by hand
    :  see drawing 4711 ;
   3:  UFRAME_NUM=2 ;
   4:  UTOOL_NUM=3 ;
   5:  UFRAME[2]=PR[7] ;
   6:  PAYLOAD[1] ;
   7:J P[1:"home"] 50% FINE    ;
   8:  //L P[98] 100mm/sec FINE    ;
   9:  R[4:speed]=120    ;
  10:L P[2:approach] 250mm/sec CNT50    ;
  11:L P[3] R[4:speed]mm/sec FINE    ;
  12:  DO[5:spindle]=ON ;
  13:L P[4] 80mm/sec CNT100 ACC80 TB    .10sec,DO[6]=ON    ;
  14:C P[5]    
    :  P[6] 80mm/sec CNT100    ;
  15:L P[7] 80mm/sec FINE    ;
  16:  FOR R[1]=1 TO 3 ;
  17:L P[3] R[4:speed]mm/sec CNT10 Offset,PR[1:INC row]    ;
  18:L P[8:step] 50mm/sec FINE INC    ;
  19:  ENDFOR ;
  20:  IF R[2]=1 OR
    :  DI[3]=ON,JMP LBL[20] ;
  21:L P[R[5]] 80mm/sec FINE    ;
  22:J PR[2:clear] 100% FINE    ;
  23:A P[9] 60mm/sec CNT100    ;
  24:A P[10] 60mm/sec CNT100    ;
  25:A P[11] 60mm/sec FINE    ;
  26:  LBL[20] ;
  27:  CALL SPINDLE_OFF    ;
  28:  Touch Sensor Start[1] ;
  29:J P[12] 100% CNT100    ;
  30:L @P[13] 2.5sec FINE    ;
  31:L P[14] 200mm/sec FINE    ;
  32:J P[77] 20% FINE    ;
  33:J PAL_1[A_1] 30% FINE    ;
  34:J P[1:home] 50% FINE    ;
/POS
P[1:"home"]{
   GP1:
	UF : 2, UT : 3,	
	J1=     0.000 deg,	J2=   -20.000 deg,	J3=    15.500 deg,
	J4=      .000 deg,	J5=   -75.500 deg,	J6=      .000 deg
};
P[2:"approach"]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   374.000  mm,	Y =   -12.250  mm,	Z =    80.000  mm,
	W =   180.000 deg,	P =     -.003 deg,	R =    30.000 deg
};
P[3]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   374.000  mm,	Y =   -12.250  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =      .000 deg,	R =    30.000 deg
};
P[4]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   424.000  mm,	Y =   -12.250  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =      .000 deg,	R =    30.000 deg
};
P[5]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   445.213  mm,	Y =    -3.463  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =      .000 deg,	R =    52.500 deg
};
P[6]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   454.000  mm,	Y =    17.750  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =      .000 deg,	R =    75.000 deg
};
P[7]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   454.000  mm,	Y =    67.750  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =      .000 deg,	R =    75.000 deg
};
P[8:"step"]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N D B, 0, 0, 0',
	X =     0.000  mm,	Y =    20.000  mm,	Z =     0.000  mm,
	W =     0.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : F, UT : F,		CONFIG : 'F U T, 0, 0, -1',
	X =   410.000  mm,	Y =    40.000  mm,	Z =    20.000  mm,
	W =  -179.500 deg,	P =     1.250 deg,	R =  -170.000 deg
};
P[10]{
   GP1:
	UF : 0, UT : 3,		CONFIG : 'F D T, 1, 0, 1',
	X =   420.000  mm,	Y =    50.000  mm,	Z =    20.000  mm,
	W =  -179.500 deg,	P =     1.250 deg,	R =  -170.000 deg
};
P[11]{
   GP1:
	UF : 2, UT : 0,		CONFIG : 'N U B, 0, -1, 0',
	X =   430.000  mm,	Y =    40.000  mm,	Z =    20.000  mm,
	W =  -179.500 deg,	P =     1.250 deg,	R =  -170.000 deg
};
P[12]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N D B, 0, 0, 0',
	X = ********  mm,	Y = ********  mm,	Z = ********  mm,
	W = ******** deg,	P = ******** deg,	R = ******** deg
};
P[13]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   430.5  mm,	Y =    40  mm,	Z =   +120.00000  mm,
	W =  -179.500 deg,	P =    90.000 deg,	R =  -170.000 deg,
	E1=     0.000  mm
};
P[14]{
   GP1:
	UF : 2, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =   430.000  mm,	Y =    40.000  mm,	Z =   150.000  mm,
	W =  -179.500 deg,	P =     1.250 deg,	R =  -170.000 deg,
	E1=   812.500  mm
};
/END
