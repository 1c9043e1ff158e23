MODULE MainModule
    LOCAL CONST robtarget pUp:=[[20,30,150],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];

    PROC main()
        MoveJ pUp,v500,z20,tTorch\WObj:=wFixture;
        ArcLStart pSeam10,v200,seam1,weld1,fine,tTorch\WObj:=wFixture;
        ArcL pSeam20,v200,seam1,weld1\Weave:=weave1,z1,tTorch\WObj:=wFixture;
        ArcCEnd pSeam30,pSeam40,v200,seam1,weld1,fine,tTorch\WObj:=wFixture;
        Service;
        ! The robot comes back from the service place
        MoveL pUp,v500,fine,tTorch\WObj:=wFixture;
    ENDPROC
ENDMODULE
