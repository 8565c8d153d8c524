//! The messages that the show firmware writes, as its own logs define them.
//!
//! Type bytes, letters, labels, units and multipliers are those in the FMT and FMTU rows of
//! ArduCopter 4.4.4 (Skybrush fork). Several multipliers repeat the scale that a format letter
//! already implies, and `SHOW` claims centimetres for metres: see [`super`] for what is applied.

use super::MessageDef;

const fn def(
    id: u8,
    name: &'static str,
    format: &'static str,
    fields: &'static str,
    units: &'static str,
    multipliers: &'static str,
) -> MessageDef {
    MessageDef { id, name, format, fields, units, multipliers }
}

/// A message type: id, length, name, letters and labels.
pub static FMT: MessageDef =
    def(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "-b---", "-----");
/// Unit and multiplier letters of a message type.
pub static FMTU: MessageDef =
    def(113, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---");
/// Meaning of a unit letter.
pub static UNIT: MessageDef = def(114, "UNIT", "QbZ", "TimeUS,Id,Label", "s--", "F--");
/// Meaning of a multiplier letter.
pub static MULT: MessageDef = def(115, "MULT", "Qbd", "TimeUS,Id,Mult", "s--", "F--");
/// A parameter's value and default.
pub static PARM: MessageDef = def(32, "PARM", "QNff", "TimeUS,Name,Value,Default", "s---", "F---");
/// A text of the firmware.
pub static MSG: MessageDef = def(59, "MSG", "QZ", "TimeUS,Message", "s-", "F-");
/// Firmware version and board.
pub static VER: MessageDef = def(
    200,
    "VER",
    "QBHBBBBIZHB",
    "TimeUS,BT,BST,Maj,Min,Pat,FWT,GH,FWS,APJ,BU",
    "s----------",
    "F----------",
);
/// Arming and disarming: the new state, the arming checks that were on, how it was done and whether
/// it was forced.
pub static ARM: MessageDef =
    def(185, "ARM", "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method", "s----", "F----");
/// An event, by ArduPilot's number.
pub static EV: MessageDef = def(180, "EV", "QB", "TimeUS,Id", "s-", "F-");
/// An error: subsystem and code.
pub static ERR: MessageDef = def(183, "ERR", "QBB", "TimeUS,Subsys,ECode", "s--", "F--");
/// Flight mode; a show is number 127, reason 32.
pub static MODE: MessageDef = def(117, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn", "s---", "F---");
/// Origin of the EKF (type 0) or home (type 1).
pub static ORGN: MessageDef = def(71, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt", "s#DUm", "F-GGB");
/// Show clock, stage, light colour and distance from the trajectory at 25 Hz.
///
/// `HDist` and `VDist` (actual minus desired) are metres although the multiplier says centimetres.
pub static SHOW: MessageDef =
    def(204, "SHOW", "QiBBBBff", "TimeUS,ClockMS,Stage,R,G,B,HDist,VDist", "ss----mm", "FC----BB");
/// Desired and actual attitude, degrees.
pub static ATT: MessageDef = def(
    70,
    "ATT",
    "QccccCCCCB",
    "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF",
    "sddddhhdh-",
    "FBBBBBBBB-",
);
/// Desired and actual body rates and the controllers' outputs.
pub static RATE: MessageDef = def(
    73,
    "RATE",
    "Qfffffffffffff",
    "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut,AOutSlew",
    "skk-kk-kk-oo--",
    "F?????????BB--",
);
/// Estimated position: global, above home and above the origin.
pub static POS: MessageDef =
    def(72, "POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", "sDUmmm", "FGG000");
/// Receiver's fix; `VZ` is positive down.
pub static GPS: MessageDef = def(
    89,
    "GPS",
    "QBBIHBcLLeffffB",
    "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
    "s#---SmDUmnhnh-",
    "F----0BGGB000--",
);
/// Accuracy of a satellite receiver: dilution of precision, standard errors of position (m), speed
/// (m/s) and yaw (degrees), and age of the fix.
pub static GPA: MessageDef = def(
    90,
    "GPA",
    "QBCCCCfBIHfHH",
    "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,Und,RTCMFU,RTCMFD",
    "s#mmmnd-ssm--",
    "F-BBBB0-CC0--",
);
/// Throttle and altitude control; `DCRt` and `CRt` are climb rates in cm/s, positive up.
pub static CTUN: MessageDef = def(
    0,
    "CTUN",
    "Qffffffefffhh",
    "TimeUS,ThI,ABst,ThO,ThH,DAlt,Alt,BAlt,DSAlt,SAlt,TAlt,DCRt,CRt",
    "s----mmmmmmnn",
    "F----00B000BB",
);
/// Battery voltage, current, charge in mAh and energy in Wh.
pub static BAT: MessageDef = def(
    85,
    "BAT",
    "QBfffffcfB",
    "TimeUS,Instance,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct",
    "s#vvAaXOw%",
    "F-000C0?00",
);
/// Pulse widths sent to the outputs 1 to 14, microseconds.
pub static RCOU: MessageDef = def(
    62,
    "RCOU",
    "QHHHHHHHHHHHHHH",
    "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14",
    "sYYYYYYYYYYYYYY",
    "F--------------",
);
/// Pulse widths sent to the outputs 15 to 18, microseconds.
pub static RCO2: MessageDef = def(201, "RCO2", "QHHHH", "TimeUS,C15,C16,C17,C18", "sYYYY", "F----");
/// Pulse widths received from the remote control, microseconds.
pub static RCIN: MessageDef = def(
    60,
    "RCIN",
    "QHHHHHHHHHHHHHH",
    "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14",
    "sYYYYYYYYYYYYYY",
    "F--------------",
);
/// Motor mixer: thrust limits and battery compensation.
pub static MOTB: MessageDef = def(
    199,
    "MOTB",
    "QfffffB",
    "TimeUS,LiftMax,BatVolt,ThLimit,ThrAvMx,ThrOut,FailFlags",
    "s------",
    "F------",
);
/// EKF3 core's attitude, velocity, position (NED) and gyroscope bias.
pub static XKF1: MessageDef = def(
    44,
    "XKF1",
    "QBccCfffffffccce",
    "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH",
    "s#ddhnnnnmmmkkkm",
    "F-BBB0000000BBBB",
);
/// EKF3 core's accelerometer bias, wind and magnetic field.
pub static XKF2: MessageDef = def(
    45,
    "XKF2",
    "QBccccchhhhhhfff",
    "TimeUS,C,AX,AY,AZ,VWN,VWE,MN,ME,MD,MX,MY,MZ,IDX,IDY,IS",
    "s#---nnGGGGGGoor",
    "F----BBCCCCCC000",
);
/// Innovations of an EKF3 core: velocity (m/s) and position (m) in north-east-down, magnetic field
/// and yaw.
pub static XKF3: MessageDef = def(
    46,
    "XKF3",
    "QBcccccchhhccff",
    "TimeUS,C,IVN,IVE,IVD,IPN,IPE,IPD,IMX,IMY,IMZ,IYAW,IVT,RErr,ErSc",
    "s#nnnmmmGGGd?--",
    "F-BBBBBBCCCBB00",
);
/// EKF3 core's variances and status.
pub static XKF4: MessageDef = def(
    47,
    "XKF4",
    "QBcccccfffHBIHb",
    "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI",
    "s#------mm-----",
    "F-------??-----",
);
/// EKF3 core's optical flow and error magnitudes.
pub static XKF5: MessageDef = def(
    48,
    "XKF5",
    "QBBhhhcccCCfff",
    "TimeUS,C,NI,FIX,FIY,AFI,HAGL,offset,RI,rng,Herr,eAng,eVel,ePos",
    "s#----m???mrnm",
    "F-----BBBBB000",
);
/// EKF3 core's attitude quaternion.
pub static XKQ: MessageDef = def(52, "XKQ", "QBffff", "TimeUS,C,Q1,Q2,Q3,Q4", "s#????", "F-????");
/// EKF3 core's selected sensors.
pub static XKFS: MessageDef =
    def(51, "XKFS", "QBBBBBB", "TimeUS,C,MI,BI,GI,AI,SS", "s#-----", "F------");
/// Position controller north: targets, desired and actual position, velocity, acceleration.
pub static PSCN: MessageDef =
    def(187, "PSCN", "Qffffffff", "TimeUS,TPN,PN,DVN,TVN,VN,DAN,TAN,AN", "smmnnnooo", "F00000000");
/// Position controller east: targets, desired and actual position, velocity, acceleration.
pub static PSCE: MessageDef =
    def(188, "PSCE", "Qffffffff", "TimeUS,TPE,PE,DVE,TVE,VE,DAE,TAE,AE", "smmnnnooo", "F00000000");
/// Position controller down; every value is positive down.
pub static PSCD: MessageDef =
    def(189, "PSCD", "Qffffffff", "TimeUS,TPD,PD,DVD,TVD,VD,DAD,TAD,AD", "smmnnnooo", "F00000000");
/// Target given to the guided controller: cm, cm/s, cm/s/s, north-east-up.
pub static GUIP: MessageDef = def(
    8,
    "GUIP",
    "QBfffbffffff",
    "TimeUS,Type,pX,pY,pZ,Terrain,vX,vY,vZ,aX,aY,aZ",
    "s-mmm-nnnooo",
    "F-BBB-BBBBBB",
);
/// Gyroscopes and accelerometers at 25 Hz per instance.
pub static IMU: MessageDef = def(
    162,
    "IMU",
    "QBffffffIIfBBHH",
    "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
    "s#EEEooo--O--zz",
    "F-000000-----00",
);
/// Vibration levels and clipping.
pub static VIBE: MessageDef =
    def(165, "VIBE", "QBfffI", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip", "s#ooo-", "F-000-");
/// Barometer: altitude (m), pressure (Pa), temperature (°C) and climb rate (m/s, positive up).
pub static BARO: MessageDef = def(
    64,
    "BARO",
    "QBffcfIffB",
    "TimeUS,I,Alt,Press,Temp,CRt,SMS,Offset,GndTemp,Health",
    "s#mPOnsmO-",
    "F-00B0C?0-",
);
/// Magnetometer: field, offsets and motor compensation about the body axes, milligauss.
pub static MAG: MessageDef = def(
    108,
    "MAG",
    "QBhhhhhhhhhBI",
    "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S",
    "s#GGGGGGGGG-s",
    "F-CCCCCCCCC-F",
);
/// Attitude controller's output noise.
pub static CTRL: MessageDef = def(
    253,
    "CTRL",
    "Qfffff",
    "TimeUS,RMSRollP,RMSRollD,RMSPitchP,RMSPitchD,RMSYaw",
    "s?????",
    "F?????",
);
/// Attitude (degrees), altitude (m) and position of the backup estimator, a DCM filter.
pub static AHR2: MessageDef = def(
    68,
    "AHR2",
    "QccCfLLffff",
    "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng,Q1,Q2,Q3,Q4",
    "sddhmDU????",
    "FBBB0GG????",
);
/// Scheduler and processor load.
pub static PM: MessageDef = def(
    178,
    "PM",
    "QHHHIIHHIIIIII",
    "TimeUS,LR,NLon,NL,MaxT,Mem,Load,ErrL,IntE,ErrC,SPIC,I2CC,I2CI,Ex",
    "sz---b%------s",
    "F----0A------F",
);
/// Log writer's own buffers.
pub static DSF: MessageDef =
    def(176, "DSF", "QIHIIII", "TimeUS,Dp,Blk,Bytes,FMn,FMx,FAv", "s--b---", "F--0---");
/// Simulated truth: attitude and position.
pub static SIM: MessageDef = def(
    75,
    "SIM",
    "QccCfLLffff",
    "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng,Q1,Q2,Q3,Q4",
    "sddhmDU????",
    "FBBB0GG????",
);
/// Simulated truth: position, velocity (NED) and air speed.
pub static SIM2: MessageDef =
    def(254, "SIM2", "Qdddffff", "TimeUS,PN,PE,PD,VN,VE,VD,As", "s???????", "F???????");
/// Telemetry of a motor controller: speed (rpm), voltage, current, temperatures (°C), charge (mAh)
/// and error rate (%).
pub static ESC: MessageDef = def(
    84,
    "ESC",
    "QBeeffcfcf",
    "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp,CTot,MotTemp,Err",
    "s#qqvAOaO%",
    "F-BB--BCB-",
);
/// A 32-bit status word of the vehicle.
pub static DU32: MessageDef = def(4, "DU32", "QBI", "TimeUS,Id,Value", "s--", "F--");
/// Traffic of a telemetry link: packets sent, received and lost, and the link's state.
pub static MAV: MessageDef =
    def(182, "MAV", "QBHHHBHH", "TimeUS,chan,txp,rxp,rxdp,flags,ss,tf", "s#----s-", "F-000-C-");
/// Path that the smart return to launch would fly back: a point in north-east-down, m, and the
/// number of points kept.
pub static SRTL: MessageDef = def(
    177,
    "SRTL",
    "QBHHBfff",
    "TimeUS,Active,NumPts,MaxPts,Action,N,E,D",
    "s----mmm",
    "F----000",
);
/// Time steps of an EKF3 core: shortest and longest interval between its inputs and its updates, s.
pub static XKT: MessageDef = def(
    53,
    "XKT",
    "QBIffffffff",
    "TimeUS,C,Cnt,IMUMin,IMUMax,EKFMin,EKFMax,AngMin,AngMax,VMin,VMax",
    "s#sssssssss",
    "F-000000000",
);
/// EKF3 core's yaw from the gravity and velocity.
pub static XKTV: MessageDef = def(54, "XKTV", "QBff", "TimeUS,C,TVS,TVD", "s#rr", "F-00");
/// EKF3 core's variances, states 0 to 11.
pub static XKV1: MessageDef = def(
    55,
    "XKV1",
    "QBffffffffffff",
    "TimeUS,C,V00,V01,V02,V03,V04,V05,V06,V07,V08,V09,V10,V11",
    "s#------------",
    "F-------------",
);
/// EKF3 core's variances, states 12 to 23.
pub static XKV2: MessageDef = def(
    56,
    "XKV2",
    "QBffffffffffff",
    "TimeUS,C,V12,V13,V14,V15,V16,V17,V18,V19,V20,V21,V22,V23",
    "s#------------",
    "F-------------",
);
/// Yaw estimator's angles and weights.
pub static XKY0: MessageDef = def(
    57,
    "XKY0",
    "QBffffffffffff",
    "TimeUS,C,YC,YCS,Y0,Y1,Y2,Y3,Y4,W0,W1,W2,W3,W4",
    "s#hdhhhhh-----",
    "F-000000000000",
);
/// Yaw estimator's velocity innovations.
pub static XKY1: MessageDef = def(
    58,
    "XKY1",
    "QBffffffffff",
    "TimeUS,C,IVN0,IVN1,IVN2,IVN3,IVN4,IVE0,IVE1,IVE2,IVE3,IVE4",
    "s#nnnnnnnnnn",
    "F-0000000000",
);
/// A piece of a file kept in the log.
pub static FILE: MessageDef =
    def(196, "FILE", "NIBZ", "FileName,Offset,Length,Data", "----", "----");

/// All messages of this catalog except the four that define others (FMT, FMTU, UNIT, MULT).
pub static ALL: &[&MessageDef] = &[
    &PARM, &MSG, &VER, &ARM, &EV, &ERR, &MODE, &ORGN, &SHOW, &ATT, &RATE, &POS, &GPS, &GPA, &CTUN,
    &BAT, &RCOU, &RCO2, &RCIN, &MOTB, &XKF1, &XKF2, &XKF3, &XKF4, &XKF5, &XKQ, &XKFS, &PSCN, &PSCE,
    &PSCD, &GUIP, &IMU, &VIBE, &BARO, &MAG, &CTRL, &AHR2, &PM, &DSF, &SIM, &SIM2, &DU32, &MAV,
    &SRTL, &XKT, &XKTV, &XKV1, &XKV2, &XKY0, &XKY1, &FILE, &ESC,
];

/// Messages that the show firmware logs by default in simulation; [`ESC`] comes only from motor
/// controllers with telemetry.
pub static FULL_SET: &[&MessageDef] = &[
    &PARM, &MSG, &VER, &ARM, &EV, &ERR, &MODE, &ORGN, &SHOW, &ATT, &RATE, &POS, &GPS, &GPA, &CTUN,
    &BAT, &RCOU, &RCO2, &RCIN, &MOTB, &XKF1, &XKF2, &XKF3, &XKF4, &XKF5, &XKQ, &XKFS, &PSCN, &PSCE,
    &PSCD, &GUIP, &IMU, &VIBE, &BARO, &MAG, &CTRL, &AHR2, &PM, &DSF, &SIM, &SIM2, &DU32, &MAV,
    &SRTL, &XKT, &XKTV, &XKV1, &XKV2, &XKY0, &XKY1, &FILE,
];

/// Messages that an analysis and a person in a log viewer need: a quarter of the size of
/// [`FULL_SET`].
pub static DEFAULT_SET: &[&MessageDef] = &[
    &PARM, &MSG, &VER, &ARM, &EV, &ERR, &MODE, &ORGN, &SHOW, &ATT, &POS, &GPS, &CTUN, &BAT, &RCOU,
    &MOTB, &XKF1, &PSCN, &PSCE, &PSCD,
];
