/// The look of report.html.
#pragma once

#include <string_view>

namespace firstlook {

inline constexpr std::string_view kReportStyle = R"css(
:root{--ink:#1c2430;--soft:#5b6675;--rule:#e3e7ec;--card:#fff;--ground:#f4f6f8;--good:#0b7a55;--caution:#9a6700;--bad:#b42318;
--detected:#00e0a4;--reprojected:#ff4d6d}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1080px;margin:0 auto;padding:28px 20px 60px}
header{display:flex;justify-content:space-between;align-items:baseline;gap:16px;flex-wrap:wrap;margin-bottom:14px}
header h1{font-size:22px;margin:0}header .brand{letter-spacing:.12em;text-transform:uppercase;font-size:12px;color:var(--soft)}
nav{font-size:13px;margin-bottom:16px}nav a{color:var(--soft);margin-right:14px;text-decoration:none}nav a:hover{text-decoration:underline}
.banner{border-radius:10px;padding:18px 22px;color:#fff;margin-bottom:16px}
.banner h2{margin:0 0 2px;font-size:24px;border:0;padding:0}.banner p{margin:0;font-size:16px}.banner ul{margin:8px 0 0;padding-left:20px}
.good{background:var(--good)}.caution{background:var(--caution)}.bad{background:var(--bad)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(126px,1fr));gap:10px;margin-bottom:16px}
.tile{background:var(--card);border:1px solid var(--rule);border-radius:10px;padding:11px 12px}
.tile b{display:block;font-size:16.5px;font-weight:600;white-space:nowrap}.tile span{display:block;color:var(--soft);font-size:12.5px;line-height:1.35}
section{background:var(--card);border:1px solid var(--rule);border-radius:10px;padding:18px 22px;margin-bottom:16px}
h2{font-size:18px;margin:0 0 10px}h3{font-size:15px;margin:18px 0 6px}
p{margin:8px 0}.hint{color:var(--soft);font-size:13.5px}
code,pre{font-family:ui-monospace,"SF Mono",Consolas,"DejaVu Sans Mono",monospace;font-size:12.8px}
code{background:#eef1f4;border-radius:4px;padding:1px 4px}
pre{background:#eef1f4;border-radius:8px;padding:10px 12px;overflow-x:auto;margin:6px 0;white-space:pre}
.scroll{overflow-x:auto}.scroll+.scroll{margin-top:14px}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
th{text-align:left;font-weight:600;color:var(--soft);font-size:12.5px;border-bottom:1px solid #cdd4dc;padding:5px 10px 5px 0}
td{border-bottom:1px solid var(--rule);padding:5px 10px 5px 0;vertical-align:top;overflow-wrap:anywhere;white-space:pre-wrap}
.num{text-align:right;white-space:nowrap}tr:last-child td{border-bottom:0}
details{margin-top:10px}summary{cursor:pointer;color:var(--soft)}
svg.chart{width:100%;height:auto;display:block}.chart text{font:12.5px system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:var(--ink)}
.chart .note{fill:var(--soft);font-size:12px;paint-order:stroke;stroke:#fff;stroke-width:3px}.chart .grid{stroke:#e6eaef}.chart .axis{stroke:#9aa5b1}.chart .mark{stroke:#9aa5b1;stroke-dasharray:3 3}
.chart .line{fill:none;stroke-width:2.2;stroke-linejoin:round}.chart .ring{fill:none;stroke:#d3d9e0}
.chart .dots{stroke-width:3;stroke-linecap:round;stroke-opacity:.45;fill:none}
.figure{max-width:860px}.pair{display:grid;grid-template-columns:minmax(0,5fr) minmax(0,3fr);gap:18px;align-items:start}
.shots{display:grid;grid-template-columns:repeat(auto-fill,minmax(230px,1fr));gap:14px}
.maps{display:grid;gap:14px 22px;margin-bottom:14px;grid-template-columns:repeat(2,minmax(0,1fr))}
.group.wide,.group.two{grid-column:1/-1}.group h3{margin:10px 0 6px}.side{display:grid;gap:14px;grid-template-columns:repeat(2,minmax(0,1fr))}.wide .side{grid-template-columns:1fr}
svg.map{display:block;width:100%;height:auto;border:1px solid var(--rule);border-radius:6px;background:#fff}
.map path{fill:none;stroke-linejoin:round;stroke-linecap:round}.map .path{stroke:#222;stroke-width:1;stroke-opacity:.35}
.map .axis-x,.map .axis-y,.map .axis-z{stroke-width:4}.map .axis-x{stroke:#d62728}.map .axis-y{stroke:#2ca02c}.map .axis-z{stroke:#1f5fd0}
.map .board{stroke:#111;stroke-width:2.5;stroke-dasharray:none}.map .part{stroke:#111;stroke-width:2;stroke-dasharray:7 5}.map .mark{stroke:#444;stroke-width:1.5}
.map .heading-sweep{stroke:#0072b2;stroke-width:1.8}.map .heading-explore{stroke:#d55e00;stroke-width:1.8}
.map circle{stroke:#fff;stroke-width:1}.map circle.sweep{fill:#0072b2}.map circle.explore{fill:#d55e00}
.map text{font-family:system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;text-anchor:middle;fill:#1c2430;paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-linejoin:round}
.map text.end{text-anchor:end}.map text.tick{fill:#5b6675}.map text.place{font-weight:600}.map text.number{stroke-width:2.5px}
.map .scale .frame{fill:none;stroke:#5b6675;stroke-width:2}
.dot{display:inline-block;width:10px;height:10px;border-radius:5px}.dot.sweep{background:#0072b2}.dot.explore{background:#d55e00}.dot.unknown{background:#8d6aba;border-radius:2px}
.dense td{padding:2px 10px 2px 0;font-size:13px}
figure{margin:0}figcaption{font-size:12.8px;padding:4px 2px}figcaption span{color:var(--soft)}
figure img,svg.shot{display:block;width:100%;height:auto;border-radius:6px}
figure .close{display:none}
svg.shot path{fill:none;vector-effect:non-scaling-stroke;stroke-width:1.3}
svg.shot .detected{stroke:var(--detected)}svg.shot .reprojected{stroke:var(--reprojected)}
.key{display:inline-block;background:#2b3038;border-radius:4px;padding:0 6px;font-weight:700}
.key.detected{color:var(--detected)}.key.reprojected{color:var(--reprojected)}
figure.shot:target{position:fixed;inset:0;z-index:9;background:rgba(16,20,26,.93);color:#fff;display:flex;flex-direction:column;align-items:center;justify-content:center;padding:24px}
figure.shot:target>a:first-child{width:min(92vw,112vh)}figure.shot:target svg.map{max-height:88vh}figure.shot:target .close{display:block;color:#fff;margin-top:6px}figure.shot:target figcaption span{color:#c7ced6}
footer{color:var(--soft);font-size:12.5px;text-align:center}
@media(max-width:640px){.pair,.maps,.side{grid-template-columns:1fr}}
@media print{body{background:#fff}section,.tile{break-inside:avoid;border-color:#ccc}nav{display:none}.banner{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";

}  // namespace firstlook
