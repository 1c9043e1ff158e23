MODULE PRESS
! Drücken: Öffnen und Schließen
PERS tooldata tGreifer:=[TRUE,[[0,0,96.5],[1,0,0,0]],[1.2,[0,0,50],[1,0,0,0],0,0,0]];
CONST robtarget pOben:=[[450.00,12.50,310.00],[0.00000,0.00000,1.00000,0.00000],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
CONST robtarget pUnten:=[[450.00,12.50,210.00],[0.00000,-0.00000,1.00000,0.00000],[0,0,-1,1000],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

FUNC bool Fertig(num n)
	RETURN n>3;
ENDFUNC
TRAP tOffen
	MoveJ pOben,vmax,fine,tGreifer;
ENDTRAP
PROC druecken()
	MoveJ pOben,vmax,z50,tGreifer;
	MoveL pUnten,v200,fine,tGreifer;
	Set doPresse;
	WaitTime 0.5;
	MoveL pOben,v200,z20,tGreifer;
ENDPROC
ENDMODULE
