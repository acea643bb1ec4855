"""The frame of every HTML page: document, cards, tables, plots in two widths, one style. Pure: values in, text out.

A page loads nothing from outside itself, so it opens offline, years later, from any folder, in light and dark mode and on
a phone. Pages with depth, charts or commands run scripts of ours (`page_script`), the others none; a policy in the page's head makes the
browser refuse everything else. All text that comes from outside is escaped.
"""

from collections.abc import Callable, Sequence
from html import escape
from typing import Final

from common.plain_text import printable_page
from phone_host.report import depth_view
from phone_host.report.page_script import Script, script, script_hash
from phone_host.svg.plot_parts import STYLE

WIDE_PX: Final = 960
NARROW_PX: Final = 340
"""Plots are drawn twice, for a desktop window and for a phone, because scaled text would be illegible on one of them."""

HALF_PX: Final = 450
"""Width of a plot that shares its row with another."""


_POLICY: Final = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""What the browser may load (Content Security Policy, level 3): pictures inside the page and its own styles."""


def document(title: str, body: str, *runs: Script) -> str:
    """Make an HTML document in the style of all our pages from a body that is already HTML.

    Args:
        title: plain text.
        body: HTML, escaped where it has to be.
        runs: CHARTS if the body has parts of `chart_view`; DEPTH if it has parts of `depth_view`, COPY if it only has commands to copy.
    """
    hashes = " ".join(f"'{script_hash(one)}'" for one in runs)
    policy = f"{_POLICY}; script-src {hashes}" if runs else _POLICY
    text = "".join(f"<script>{script(one)}</script>" for one in runs)
    style = f"{_PAGE_STYLE}{STYLE}{depth_view.STYLE if runs else ''}"
    return printable_page(
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1"><meta name="color-scheme" content="light dark">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body><main>{body}</main>{text}</body></html>\n"
    )


def section(title: str, explanation: str, content: str) -> str:
    """Make one card of a page.

    Args:
        title: plain text.
        explanation: plain text below the title, may be empty.
        content: HTML.
    """
    words = f"<p>{escape(explanation)}</p>" if explanation else ""
    return f"<section><h2>{escape(title)}</h2>{words}{content}</section>"


def two_widths(draw: Callable[[int], str], wide_px: int = WIDE_PX) -> str:
    """Show a plot drawn for a wide window or one drawn for a phone; the window's width decides.

    Args:
        draw: returns the plot for a width in px.
        wide_px: width in a wide window.
    """
    return f'<div class="wide">{draw(wide_px)}</div><div class="narrow">{draw(NARROW_PX)}</div>'


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, tight: bool = False) -> str:
    """Make a table that scrolls on its own if it is too wide.

    Args:
        columns: names.
        rows: plain texts; if a row has fewer cells than columns, its last cell spans the rest.
        tight: small print, for many columns.
    """
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = ""
    for row in rows:
        last = f'<td colspan="{len(columns) - len(row) + 1}">' if len(row) < len(columns) else "<td>"
        body += f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row[:-1])}{last}{escape(row[-1])}</td></tr>"
    kind = ' class="tight"' if tight else ""
    return f'<div class="scroll"><table{kind}><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


_PAGE_STYLE: Final = """
:root{color-scheme:light dark;--bg:#f4f5f7;--card:#fff;--ink:#1a1e24;--ink2:#5c6570;--line:#e2e6ea;--edge:#1a1e2440;--link:#0a5fa8;
--good:#0b7a55;--warning:#8a5a00;--bad:#b3261e}
@media (prefers-color-scheme:dark){:root{--bg:#101318;--card:#191d24;--ink:#e9ecf0;--ink2:#9ba5b1;--line:#2b323b;--edge:#ffffff38;--link:#7cc0ff;
--good:#3ecf9b;--warning:#f0b43c;--bad:#ff8a80}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",sans-serif}
main{max-width:1040px;margin:0 auto;padding:2rem 1.25rem 3rem;display:grid;gap:1.25rem}
main>*{min-width:0;margin:0}
h1{font-size:1.7rem;line-height:1.2;letter-spacing:-.01em;margin:0}h2{font-size:1.05rem;margin:0 0 .25rem}h3{font-size:.95rem;margin:1.25rem 0 .5rem}
.sub,section>p{color:var(--ink2);margin:.25rem 0 0}h1,.sub{overflow-wrap:anywhere}section>p{font-size:.9rem;margin:0 0 .75rem;max-width:95ch}
.verdict{display:flex;gap:.75rem;align-items:baseline;padding:.8rem 1rem;border-radius:10px;background:var(--card);
border:1px solid var(--line);border-left:4px solid currentColor}
.verdict span{color:var(--ink)}.good{color:var(--good)}.warning{color:var(--warning)}.bad{color:var(--bad)}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:1px;background:var(--card);
border:1px solid var(--line);border-radius:10px;overflow:hidden}
.figures div{box-shadow:0 0 0 1px var(--line);padding:.8rem 1rem}.figures dt{color:var(--ink2);font-size:.85rem}
.figures dd{margin:0;font-size:1.5rem;font-weight:600;letter-spacing:-.01em;font-variant-numeric:tabular-nums;line-height:1.3}
.figures small{font-size:.9rem;font-weight:400;color:var(--ink2)}
.figures dd.note{font-size:.8rem;font-weight:400;color:var(--ink2);letter-spacing:0}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(260px,1fr));gap:1rem;align-items:start}
.pictures figure{margin:0}.pictures img{display:block;width:100%;height:auto;border-radius:8px;border:1px solid var(--line)}
.pictures figcaption{font-size:.85rem;color:var(--ink2);margin-top:.35rem}
.views2{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,420px),1fr));gap:1rem;align-items:start;margin-top:.75rem}
.views2 figure{margin:0;min-width:0}.views2 figcaption{font-size:.85rem;color:var(--ink2);margin-top:.3rem;overflow-wrap:anywhere}.views2 b{color:var(--ink)}
.chart{margin:.75rem 0 0}.chart figcaption{font-size:.85rem;color:var(--ink2);margin-top:.3rem}
.both{display:grid;grid-template-columns:1fr 1fr;gap:3px;align-items:start}
section{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:1.1rem 1.25rem}
.pair .sub{font-size:.85rem}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:1.25rem}.pair>*{min-width:0}
.wide+.wide,.narrow+.wide{margin-top:1rem}.narrow{display:none}
.scroll{overflow-x:auto;background:linear-gradient(to right,var(--card) 40%,transparent) left/2.5rem 100% no-repeat local,
linear-gradient(to left,var(--card) 40%,transparent) right/2.5rem 100% no-repeat local,
linear-gradient(to right,var(--edge),transparent) left/1.1rem 100% no-repeat,linear-gradient(to left,var(--edge),transparent) right/1.1rem 100% no-repeat}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums;min-width:50%}
th,td{text-align:left;padding:.35rem 1.5rem .35rem 0;border-bottom:1px solid var(--line)}th{color:var(--ink2);font-weight:500}
tr:last-child td{border-bottom:0}.tight{white-space:nowrap;font-size:.75rem}.tight td,.tight th{padding-right:.55rem}.tight td:nth-child(2){white-space:normal;min-width:8.5rem}
section>p:last-child{margin-bottom:0}
details{margin-top:.75rem;font-size:.9rem;color:var(--ink2)}summary{cursor:pointer}
.words{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1rem;margin:.5rem 0 0}.words dt{color:var(--ink)}.words dd{margin:0}
a{color:var(--link)}.files dt{font-weight:600}.share{display:flex;height:1rem;border-radius:4px;overflow:hidden;margin:.5rem 0}
.command{display:flex;gap:.6rem;align-items:flex-start;margin:.25rem 0 .9rem}.command code{flex:1;min-width:0;padding:.45rem .6rem;background:var(--bg);
border:1px solid var(--line);border-radius:6px;font:.85rem/1.5 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere}
.command+p,.for{margin:0;font-size:.9rem;color:var(--ink2)}
section ul.small{font-size:.85rem;color:var(--ink2);margin-top:.6rem}section ul{margin:.25rem 0 0;padding-left:1.2rem}
@media (max-width:700px){main{padding:1.25rem .9rem 2rem}.pair{grid-template-columns:1fr}.wide{display:none}
.narrow{display:block}th,td{padding-right:.8rem}.narrow+.wide+.narrow{margin-top:1rem}section{padding:1rem}.figures{grid-template-columns:1fr 1fr}
.figures dd{font-size:1.25rem}.words.files{grid-template-columns:1fr}.files dd{margin-bottom:.4rem}h1{font-size:1.4rem}}
"""
