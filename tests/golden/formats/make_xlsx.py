"""Writes the workbooks of the tests: python3 make_xlsx.py (needs openpyxl)."""
import datetime as dt
from openpyxl import Workbook

book = Workbook()
info = book.active
info.title = "Info"
info["A1"] = "Motor"
info["B1"] = "M-100"
info["A2"] = "Serial"
info["B2"] = 4711

log = book.create_sheet("Log")
log["B3"] = "  time_s "
log["C3"] = "voltage_V"
log["D3"] = "on"
log["E3"] = "when"
log["F3"] = "took"
log.merge_cells("B1:F1")
log["B1"] = "Recording"
day = dt.datetime(2024, 1, 2, 3, 4, 5, 500000)
for n in range(4):
    row = 5 + n + (n > 1)  # one blank row inside
    log.cell(row, 2, n * 0.1)
    log.cell(row, 3, [1 / 3, -1e-7, 12, 1e20][n])
    log.cell(row, 4, n % 2 == 1)
    log.cell(row, 5, day + dt.timedelta(seconds=0.01 * n))
    log.cell(row, 6, dt.timedelta(hours=30, seconds=n))
log["C10"] = "#N/A"
log["C10"].data_type = "e"
log["D10"] = "=1/0"
log.column_dimensions["H"].width = 30

more = book.create_sheet("More")
for n in range(3):
    more.append([n, n * n])
hidden = book.create_sheet("Hidden", 0)
hidden.sheet_state = "hidden"
for n in range(3):
    hidden.append([n])
book.active = 1
book.save("log.xlsx")

far = Workbook()
sheet = far.active
sheet.append(["t", "v"])
for n in range(3):
    sheet.append([n, 2 * n])
sheet["XFD1048576"] = 1
far.save("far.xlsx")

iso = Workbook(iso_dates=True)
sheet = iso.active
sheet.append(["t", "d", "c"])
sheet.append([dt.datetime(2024, 1, 2, 3, 4, 5), dt.date(2000, 2, 29), dt.time(12, 30)])
sheet.append([dt.datetime(2024, 1, 2, 3, 4, 6), dt.date(1900, 3, 1), dt.time(0, 0, 1)])
iso.save("iso.xlsx")
