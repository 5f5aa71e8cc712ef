"""A bucket that answers after a delay: `bucket.py FOLDER PORT DELAY_S`, for the time of a gathering, with
`AWS_ENDPOINT_URL=http://127.0.0.1:PORT tipwatch screen --gather s3://b/fleet --out s3://b/out`, where FOLDER/fleet holds the records.

It knows GET, HEAD, PUT, DELETE, lists and lists of deletes, looks at no credentials, and prints how many requests came.
"""
import asyncio, os, sys, hashlib, collections
from urllib.parse import unquote, parse_qs
from xml.sax.saxutils import escape
root, port, delay = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
count = collections.Counter()
names = {}
def walk():
    for d, _, fs in os.walk(root,followlinks=True):
        for f in fs:
            p=os.path.join(d,f); names[os.path.relpath(p,root)] = os.path.getsize(p)
walk(); ordered = sorted(names)
class P(asyncio.Protocol):
    def connection_made(self, t): self.t=t; self.buf=b""
    def data_received(self, d):
        self.buf += d
        while True:
            i=self.buf.find(b"\r\n\r\n")
            if i<0: return
            head=self.buf[:i].decode("latin1").split("\r\n"); h={}
            for l in head[1:]:
                k,_,v=l.partition(":"); h[k.lower()]=v.strip()
            n=int(h.get("content-length","0"))
            if len(self.buf)<i+4+n: return
            body=self.buf[i+4:i+4+n]; self.buf=self.buf[i+4+n:]
            asyncio.get_running_loop().call_later(delay, self.answer, head[0], h, body)
    def send(self, status, body=b"", extra="", head=False):
        self.t.write(f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n{extra}\r\n".encode()+(b"" if head else body))
    def answer(self, line, h, body):
        global ordered
        m,url,_=line.split(" "); path,_,q=url.partition("?"); q={k:v[0] for k,v in parse_qs(q,keep_blank_values=True).items()}
        parts=unquote(path).lstrip("/").split("/",1); key=parts[1] if len(parts)>1 else ""
        count[m+(" list" if not key else "")]+=1
        if m=="GET" and not key:
            import bisect
            prefix=q.get("prefix",""); after=q.get("continuation-token") or q.get("start-after","")
            if len(ordered)!=len(names): ordered=sorted(names)
            i=bisect.bisect_right(ordered,after) if after else bisect.bisect_left(ordered,prefix)
            out=[]
            while i<len(ordered) and len(out)<1000:
                k=ordered[i]
                if k.startswith(prefix): out.append(k)
                elif k>prefix: break
                i+=1
            more=len(out)==1000
            x="".join(f"<Contents><Key>{escape(k)}</Key><LastModified>2026-01-01T00:00:00.000Z</LastModified><ETag>&quot;0&quot;</ETag><Size>{names[k]}</Size></Contents>" for k in out)
            t=f"<NextContinuationToken>{escape(out[-1])}</NextContinuationToken>" if more else ""
            self.send("200 OK",f'<?xml version="1.0"?><ListBucketResult xmlns="http://s3.amazonaws.com/doc/2006-03-01/"><Name>b</Name><Prefix>{escape(prefix)}</Prefix><KeyCount>{len(out)}</KeyCount><MaxKeys>1000</MaxKeys><IsTruncated>{str(more).lower()}</IsTruncated>{t}{x}</ListBucketResult>'.encode()); return
        p=os.path.join(root,key)
        if m in("GET","HEAD"):
            if key not in names: self.send("404 Not Found",b"<Error><Code>NoSuchKey</Code></Error>",head=m=="HEAD"); return
            b=open(p,"rb").read(); s="200 OK"; e=f'ETag: "{len(b)}"\r\nLast-Modified: Thu, 01 Jan 2026 00:00:00 GMT\r\nAccept-Ranges: bytes\r\n'
            r=h.get("range")
            if r:
                a,_,z=r[6:].partition("-"); tot=len(b); a0=int(a) if a else max(0,tot-int(z)); z0=min(int(z) if a and z else tot-1,tot-1); b=b[a0:z0+1]; s="206 Partial Content"; e+=f"Content-Range: bytes {a0}-{z0}/{tot}\r\n"
            self.send(s,b,e,head=m=="HEAD")
        elif m=="PUT":
            os.makedirs(os.path.dirname(p),exist_ok=True); open(p,"wb").write(body); names[key]=len(body); self.send("200 OK",b"",'ETag: "1"\r\n')
        elif m=="DELETE":
            if key in names: os.remove(p); del names[key]
            self.send("204 No Content")
        elif m=="POST":
            import re
            for k in re.findall(r"<Key>(.*?)</Key>",body.decode()):
                if k in names: os.remove(os.path.join(root,k)); del names[k]
            self.send("200 OK",b'<?xml version="1.0"?><DeleteResult xmlns="http://s3.amazonaws.com/doc/2006-03-01/">'+b"".join(b"<Deleted><Key>"+k+b"</Key></Deleted>" for k in re.findall(rb"<Key>(.*?)</Key>",body))+b"</DeleteResult>")
async def main():
    s=await asyncio.get_running_loop().create_server(P,"127.0.0.1",port,backlog=1000)
    async def say():
        while True:
            await asyncio.sleep(5); print(dict(count),flush=True)
    asyncio.ensure_future(say())
    await s.serve_forever()
asyncio.run(main())
