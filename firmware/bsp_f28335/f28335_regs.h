/**
 * @file f28335_regs.h
 * @brief The registers of the TMS320F28335 that this firmware touches, as tables.
 *
 * `make bsp-regs C2000WARE_DIR=...` compares every row with TI's headers: address, width, place of
 * every field. Addresses are those of 16-bit words. Which registers EALLOW protects comes from the
 * reference manual and is not checked there.
 */
#ifndef F28335_REGS_H
#define F28335_REGS_H

/* clang-format off */

/** REG(name, address, width in bits, EALLOW or OPEN, TI's structure, TI's member) */
#define F28335_REGISTERS(REG)                                             \
    /* system control */                                                  \
    REG(PLLSTS,       0x7011, 16, EALLOW, SysCtrlRegs,  PLLSTS)           \
    REG(HISPCP,       0x701A, 16, EALLOW, SysCtrlRegs,  HISPCP)           \
    REG(LOSPCP,       0x701B, 16, EALLOW, SysCtrlRegs,  LOSPCP)           \
    REG(PCLKCR0,      0x701C, 16, EALLOW, SysCtrlRegs,  PCLKCR0)          \
    REG(PCLKCR1,      0x701D, 16, EALLOW, SysCtrlRegs,  PCLKCR1)          \
    REG(PCLKCR3,      0x7020, 16, EALLOW, SysCtrlRegs,  PCLKCR3)          \
    REG(PLLCR,        0x7021, 16, EALLOW, SysCtrlRegs,  PLLCR)            \
    REG(WDCR,         0x7029, 16, EALLOW, SysCtrlRegs,  WDCR)             \
    /* flash timing */                                                    \
    REG(FOPT,         0x0A80, 16, EALLOW, FlashRegs,    FOPT)             \
    REG(FSTDBYWAIT,   0x0A84, 16, EALLOW, FlashRegs,    FSTDBYWAIT)       \
    REG(FACTIVEWAIT,  0x0A85, 16, EALLOW, FlashRegs,    FACTIVEWAIT)      \
    REG(FBANKWAIT,    0x0A86, 16, EALLOW, FlashRegs,    FBANKWAIT)        \
    REG(FOTPWAIT,     0x0A87, 16, EALLOW, FlashRegs,    FOTPWAIT)         \
    /* interrupt expansion */                                             \
    REG(PIECTRL,      0x0CE0, 16, OPEN,   PieCtrlRegs,  PIECTRL)          \
    REG(PIEACK,       0x0CE1, 16, OPEN,   PieCtrlRegs,  PIEACK)           \
    /* ADC */                                                             \
    REG(ADCTRL1,      0x7100, 16, OPEN,   AdcRegs,      ADCTRL1)          \
    REG(ADCTRL2,      0x7101, 16, OPEN,   AdcRegs,      ADCTRL2)          \
    REG(ADCMAXCONV,   0x7102, 16, OPEN,   AdcRegs,      ADCMAXCONV)       \
    REG(ADCCHSELSEQ1, 0x7103, 16, OPEN,   AdcRegs,      ADCCHSELSEQ1)     \
    REG(ADCTRL3,      0x7118, 16, OPEN,   AdcRegs,      ADCTRL3)          \
    REG(ADCST,        0x7119, 16, OPEN,   AdcRegs,      ADCST)            \
    REG(ADCMIRROR0,   0x0B00, 16, OPEN,   AdcMirror,    ADCRESULT0)       \
    REG(ADCMIRROR1,   0x0B01, 16, OPEN,   AdcMirror,    ADCRESULT1)       \
    /* ePWM1 */                                                           \
    REG(TBCTL,        0x6800, 16, OPEN,   EPwm1Regs,    TBCTL)            \
    REG(TBCTR,        0x6804, 16, OPEN,   EPwm1Regs,    TBCTR)            \
    REG(TBPRD,        0x6805, 16, OPEN,   EPwm1Regs,    TBPRD)            \
    REG(ETSEL,        0x6819, 16, OPEN,   EPwm1Regs,    ETSEL)            \
    REG(ETPS,         0x681A, 16, OPEN,   EPwm1Regs,    ETPS)             \
    REG(ETFLG,        0x681B, 16, OPEN,   EPwm1Regs,    ETFLG)            \
    REG(ETCLR,        0x681C, 16, OPEN,   EPwm1Regs,    ETCLR)            \
    /* SPI-A */                                                           \
    REG(SPICCR,       0x7040, 16, OPEN,   SpiaRegs,     SPICCR)           \
    REG(SPICTL,       0x7041, 16, OPEN,   SpiaRegs,     SPICTL)           \
    REG(SPISTS,       0x7042, 16, OPEN,   SpiaRegs,     SPISTS)           \
    REG(SPIBRR,       0x7044, 16, OPEN,   SpiaRegs,     SPIBRR)           \
    REG(SPIRXBUF,     0x7047, 16, OPEN,   SpiaRegs,     SPIRXBUF)         \
    REG(SPITXBUF,     0x7048, 16, OPEN,   SpiaRegs,     SPITXBUF)         \
    REG(SPIFFTX,      0x704A, 16, OPEN,   SpiaRegs,     SPIFFTX)          \
    REG(SPIPRI,       0x704F, 16, OPEN,   SpiaRegs,     SPIPRI)           \
    /* pins */                                                            \
    REG(GPAMUX2,      0x6F88, 32, EALLOW, GpioCtrlRegs, GPAMUX2)          \
    REG(GPBMUX1,      0x6F96, 32, EALLOW, GpioCtrlRegs, GPBMUX1)          \
    REG(GPBDIR,       0x6F9A, 32, EALLOW, GpioCtrlRegs, GPBDIR)           \
    REG(GPCMUX1,      0x6FA6, 32, EALLOW, GpioCtrlRegs, GPCMUX1)          \
    REG(GPCMUX2,      0x6FA8, 32, EALLOW, GpioCtrlRegs, GPCMUX2)          \
    REG(GPBSET,       0x6FCA, 32, OPEN,   GpioDataRegs, GPBSET)           \
    REG(GPBCLEAR,     0x6FCC, 32, OPEN,   GpioDataRegs, GPBCLEAR)         \
    /* external bus */                                                    \
    REG(XTIMING0,     0x0B20, 32, EALLOW, XintfRegs,    XTIMING0)         \
    REG(XTIMING6,     0x0B2C, 32, EALLOW, XintfRegs,    XTIMING6)         \
    REG(XTIMING7,     0x0B2E, 32, EALLOW, XintfRegs,    XTIMING7)         \
    REG(XINTCNF2,     0x0B34, 32, EALLOW, XintfRegs,    XINTCNF2)

/** ARRAY(name, address, width, words from item to item, items, access, structure, first, last) */
#define F28335_ARRAYS(ARRAY)                                                        \
    ARRAY(PIEIER,  0x0CE2, 16, 2, 12,  OPEN,   PieCtrlRegs,  PIEIER1,       PIEIER12) \
    ARRAY(PIEIFR,  0x0CE3, 16, 2, 12,  OPEN,   PieCtrlRegs,  PIEIFR1,       PIEIFR12) \
    ARRAY(PIEVECT, 0x0D00, 32, 2, 128, EALLOW, PieVectTable, PIE1_RESERVED, LUF)

/** FIELD(register, field, lowest bit, bits, TI's structure, TI's member): fields of REG rows */
#define F28335_FIELDS(FIELD)                                       \
    FIELD(PLLSTS,       PLLLOCKS,       0,  1, SysCtrlRegs,  PLLSTS)  \
    FIELD(PLLSTS,       MCLKSTS,        3,  1, SysCtrlRegs,  PLLSTS)  \
    FIELD(PLLSTS,       MCLKOFF,        6,  1, SysCtrlRegs,  PLLSTS)  \
    FIELD(PLLSTS,       DIVSEL,         7,  2, SysCtrlRegs,  PLLSTS)  \
    FIELD(PLLCR,        DIV,            0,  4, SysCtrlRegs,  PLLCR)   \
    FIELD(HISPCP,       HSPCLK,         0,  3, SysCtrlRegs,  HISPCP)  \
    FIELD(LOSPCP,       LSPCLK,         0,  3, SysCtrlRegs,  LOSPCP)  \
    FIELD(PCLKCR0,      TBCLKSYNC,      2,  1, SysCtrlRegs,  PCLKCR0) \
    FIELD(PCLKCR0,      ADCENCLK,       3,  1, SysCtrlRegs,  PCLKCR0) \
    FIELD(PCLKCR0,      SPIAENCLK,      8,  1, SysCtrlRegs,  PCLKCR0) \
    FIELD(PCLKCR1,      EPWM1ENCLK,     0,  1, SysCtrlRegs,  PCLKCR1) \
    FIELD(PCLKCR3,      XINTFENCLK,    12,  1, SysCtrlRegs,  PCLKCR3) \
    FIELD(PCLKCR3,      GPIOINENCLK,   13,  1, SysCtrlRegs,  PCLKCR3) \
    FIELD(FOPT,         ENPIPE,         0,  1, FlashRegs,    FOPT)        \
    FIELD(FSTDBYWAIT,   STDBYWAIT,      0,  9, FlashRegs,    FSTDBYWAIT)  \
    FIELD(FACTIVEWAIT,  ACTIVEWAIT,     0,  9, FlashRegs,    FACTIVEWAIT) \
    FIELD(FBANKWAIT,    RANDWAIT,       0,  4, FlashRegs,    FBANKWAIT)   \
    FIELD(FBANKWAIT,    PAGEWAIT,       8,  4, FlashRegs,    FBANKWAIT)   \
    FIELD(FOTPWAIT,     OTPWAIT,        0,  5, FlashRegs,    FOTPWAIT)    \
    FIELD(PIECTRL,      ENPIE,          0,  1, PieCtrlRegs,  PIECTRL) \
    FIELD(PIEACK,       ACK1,           0,  1, PieCtrlRegs,  PIEACK)  \
    FIELD(ADCTRL1,      ACQ_PS,         8,  4, AdcRegs,      ADCTRL1) \
    FIELD(ADCTRL2,      EPWM_SOCA_SEQ1, 8,  1, AdcRegs,      ADCTRL2) \
    FIELD(ADCTRL2,      INT_ENA_SEQ1,  11,  1, AdcRegs,      ADCTRL2) \
    FIELD(ADCTRL2,      SOC_SEQ1,      13,  1, AdcRegs,      ADCTRL2) \
    FIELD(ADCTRL2,      RST_SEQ1,      14,  1, AdcRegs,      ADCTRL2) \
    FIELD(ADCMAXCONV,   MAX_CONV1,      0,  4, AdcRegs,      ADCMAXCONV)   \
    FIELD(ADCCHSELSEQ1, CONV00,         0,  4, AdcRegs,      ADCCHSELSEQ1) \
    FIELD(ADCCHSELSEQ1, CONV01,         4,  4, AdcRegs,      ADCCHSELSEQ1) \
    FIELD(ADCTRL3,      ADCPWDN,        5,  1, AdcRegs,      ADCTRL3) \
    FIELD(ADCTRL3,      ADCBGRFDN,      6,  2, AdcRegs,      ADCTRL3) \
    FIELD(ADCST,        INT_SEQ1,       0,  1, AdcRegs,      ADCST)   \
    FIELD(ADCST,        INT_SEQ1_CLR,   4,  1, AdcRegs,      ADCST)   \
    FIELD(TBCTL,        CTRMODE,        0,  2, EPwm1Regs,    TBCTL)   \
    FIELD(TBCTL,        HSPCLKDIV,      7,  3, EPwm1Regs,    TBCTL)   \
    FIELD(TBCTL,        CLKDIV,        10,  3, EPwm1Regs,    TBCTL)   \
    FIELD(ETSEL,        SOCASEL,        8,  3, EPwm1Regs,    ETSEL)   \
    FIELD(ETSEL,        SOCAEN,        11,  1, EPwm1Regs,    ETSEL)   \
    FIELD(ETPS,         SOCAPRD,        8,  2, EPwm1Regs,    ETPS)    \
    FIELD(ETFLG,        SOCA,           2,  1, EPwm1Regs,    ETFLG)   \
    FIELD(ETCLR,        SOCA,           2,  1, EPwm1Regs,    ETCLR)   \
    FIELD(SPICCR,       SPICHAR,        0,  4, SpiaRegs,     SPICCR)  \
    FIELD(SPICCR,       CLKPOLARITY,    6,  1, SpiaRegs,     SPICCR)  \
    FIELD(SPICCR,       SPISWRESET,     7,  1, SpiaRegs,     SPICCR)  \
    FIELD(SPICTL,       TALK,           1,  1, SpiaRegs,     SPICTL)  \
    FIELD(SPICTL,       MASTER_SLAVE,   2,  1, SpiaRegs,     SPICTL)  \
    FIELD(SPICTL,       CLK_PHASE,      3,  1, SpiaRegs,     SPICTL)  \
    FIELD(SPISTS,       BUFFULL_FLAG,   5,  1, SpiaRegs,     SPISTS)  \
    FIELD(SPISTS,       INT_FLAG,       6,  1, SpiaRegs,     SPISTS)  \
    FIELD(SPIFFTX,      TXFIFO,        13,  1, SpiaRegs,     SPIFFTX) \
    FIELD(SPIFFTX,      SPIFFENA,      14,  1, SpiaRegs,     SPIFFTX) \
    FIELD(SPIFFTX,      SPIRST,        15,  1, SpiaRegs,     SPIFFTX) \
    FIELD(SPIPRI,       FREE,           4,  1, SpiaRegs,     SPIPRI)  \
    FIELD(GPAMUX2,      GPIO16,         0,  2, GpioCtrlRegs, GPAMUX2) \
    FIELD(GPAMUX2,      GPIO18,         4,  2, GpioCtrlRegs, GPAMUX2) \
    FIELD(GPAMUX2,      GPIO19,         6,  2, GpioCtrlRegs, GPAMUX2) \
    FIELD(GPAMUX2,      GPIO28,        24,  2, GpioCtrlRegs, GPAMUX2) \
    FIELD(GPAMUX2,      GPIO31,        30,  2, GpioCtrlRegs, GPAMUX2) \
    FIELD(GPBMUX1,      GPIO32,         0,  2, GpioCtrlRegs, GPBMUX1) \
    FIELD(GPBMUX1,      GPIO34,         4,  2, GpioCtrlRegs, GPBMUX1) \
    FIELD(GPBMUX1,      GPIO47,        30,  2, GpioCtrlRegs, GPBMUX1) \
    FIELD(GPBDIR,       GPIO32,         0,  1, GpioCtrlRegs, GPBDIR)  \
    FIELD(GPCMUX1,      GPIO64,         0,  2, GpioCtrlRegs, GPCMUX1) \
    FIELD(GPCMUX1,      GPIO79,        30,  2, GpioCtrlRegs, GPCMUX1) \
    FIELD(GPCMUX2,      GPIO80,         0,  2, GpioCtrlRegs, GPCMUX2) \
    FIELD(GPCMUX2,      GPIO87,        14,  2, GpioCtrlRegs, GPCMUX2) \
    FIELD(GPBSET,       GPIO32,         0,  1, GpioDataRegs, GPBSET)  \
    FIELD(GPBCLEAR,     GPIO32,         0,  1, GpioDataRegs, GPBCLEAR) \
    FIELD(XTIMING0,     XWRTRAIL,       0,  2, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XWRACTIVE,      2,  3, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XWRLEAD,        5,  2, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XRDTRAIL,       7,  2, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XRDACTIVE,      9,  3, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XRDLEAD,       12,  2, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     XSIZE,         16,  2, XintfRegs,    XTIMING0) \
    FIELD(XTIMING0,     X2TIMING,      22,  1, XintfRegs,    XTIMING0) \
    FIELD(XINTCNF2,     WRBUFF,         0,  2, XintfRegs,    XINTCNF2) \
    FIELD(XINTCNF2,     CLKOFF,         3,  1, XintfRegs,    XINTCNF2) \
    FIELD(XINTCNF2,     XTIMCLK,       16,  3, XintfRegs,    XINTCNF2)

/* clang-format on */

/** Slot of ADCINT in PIEVECT and its bit in PIEIER 1: group 1, interrupt 6. */
#define F28335_ADCINT_VECTOR 37
#define F28335_ADCINT_BIT 0x0020u

/** Where the factory left the routine that calibrates the ADC. */
#define F28335_ADC_CAL 0x380080L

#endif
