; First instructions of the program: the boot ROM, or the debugger, jumps to code_start.
; The watchdog must stop here already: it would bite while c_int00 fills the variables.

        .ref    _c_int00
        .def    code_start

WDCR    .set    7029h

        .sect   "codestart"             ; two words: a branch and no more
code_start:
        LB      without_watchdog

        .text
without_watchdog:
        SETC    OBJMODE                 ; the boot ROM leaves C27x mode behind in some paths
        EALLOW
        MOVZ    DP, #(WDCR >> 6)
        MOV     @WDCR, #0068h           ; WDDIS and the check bits 101
        EDIS
        LB      _c_int00
        .end
