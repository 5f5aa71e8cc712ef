"""Times `fleet.html` in headless Chromium: load, table, sort and filter. `page.py FLEET.html`, with websocket-client."""
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests/browser"))
from report import Browser

page=Path(sys.argv[1]).resolve()
with tempfile.TemporaryDirectory() as p:
    b=Browser(p)
    for d in ("Page","Runtime"): b.ask(d+".enable")
    b.ask("Page.navigate", url=page.as_uri()); b.wait_for("Page.loadEventFired"); t=time.perf_counter()
    while not b.run("document.querySelectorAll('th button').length"): time.sleep(0.02)
    print("table after load", time.perf_counter()-t)
    for name,js in [("sort margin","[...document.querySelectorAll('button')].find(e=>e.textContent.trim().startsWith('Worst margin')).click()"),
      ("sort speed","[...document.querySelectorAll('button')].find(e=>e.textContent.trim().startsWith('Speed')).click()"),
      ("sort machine","[...document.querySelectorAll('button')].find(e=>e.textContent.trim().startsWith('Machine')).click()"),
      ("filter machine","(s=>{s.value=[...s.options][3].value;s.dispatchEvent(new Event('input',{bubbles:true}));s.dispatchEvent(new Event('change',{bubbles:true}))})(document.querySelectorAll('select')[0])"),
      ("filter event","(s=>{s.value=[...s.options][3].value;s.dispatchEvent(new Event('input',{bubbles:true}));s.dispatchEvent(new Event('change',{bubbles:true}))})(document.querySelectorAll('select')[3])"),
      ("clear","[...document.querySelectorAll('button')].find(e=>e.textContent.trim().startsWith('Clear')).click()"),
      ("text","(s=>{s.value='shift_0232';s.dispatchEvent(new Event('input',{bubbles:true}))})([...document.querySelectorAll('input')].at(-1))")]:
        t=b.run("(()=>{const t=performance.now();"+js+";document.body.offsetHeight;return performance.now()-t})()")
        time.sleep(0.6)
        print(name,round(t or -1),"ms", b.run("(document.querySelector('.count,#count,[aria-live]')||{}).textContent"), b.run("[...document.querySelectorAll('table')].map(t=>t.rows.length).join(',')"))
    print(b.run("[...document.querySelectorAll('select')].map(s=>s.getAttribute('aria-label')+s.name+': '+[...s.options].slice(0,8).map(o=>o.textContent).join('|')).join('\\n')"))
    b.close()
